// part: arithmetic
// sanitized: -O1
/// \file firn/data/{random,samples,poisson_disk,sampling}.hpp: how shapes are filled, and that it repeats bit for bit.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/data/sampling.hpp>
#include <firn/io/obj.hpp>

#include "meshes.hpp"

#include <bit>
#include <limits>
#include <numbers>
#include <set>

using namespace firn;
using test_support::holds;
using test_support::message;
using test_support::not_a_number;
using namespace test_meshes;

namespace sampling_tests {
namespace {

constexpr double pi = std::numbers::pi;

template <int D>
double total_volume(const Samples<D>& samples) {
    return samples.volume * double(samples.positions.size());
}

/// A hash of the positions' bits, in order.
template <int D>
std::uint64_t hash(const std::vector<Vec<double, D>>& positions) {
    std::uint64_t h = positions.size();
    for (const auto& x : positions) {
        for (int k = 0; k < D; ++k) h = mix_bits(h ^ std::bit_cast<std::uint64_t>(x[k])) + 1;
    }
    return h;
}

template <int D>
double least_distance(const std::vector<Vec<double, D>>& points) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const auto d = points[i] - points[j];
            least = std::min(least, dot(d, d));
        }
    }
    return std::sqrt(least);
}

/// The greatest distance from a place of the box to its nearest point, over probes a sixth of `radius` apart.
template <int D>
double widest_hole(const std::vector<Vec<double, D>>& points, const Vec<double, D>& lower, const Vec<double, D>& upper,
                   double radius) {
    const auto probes = sample_box<D>(lower, upper, {.spacing = radius / 6}).positions;
    double widest = 0;
    for (const auto& x : probes) {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& p : points) nearest = std::min(nearest, dot(p - x, p - x));
        widest = std::max(widest, nearest);
    }
    return std::sqrt(widest);
}

}  // namespace

TEST_CASE("The random numbers are splitmix64's: its published first numbers, and even in every axis") {
    // The generator's first outputs from state 1234567 (Vigna's reference implementation, as many libraries test it).
    const auto splitmix64 = [](std::uint64_t state, std::uint64_t n) {
        return mix_bits(state + (n + 1) * 0x9e3779b97f4a7c15u);
    };
    CHECK(splitmix64(1234567, 0) == 6457827717110365317u);
    CHECK(splitmix64(1234567, 1) == 3203168211198807973u);
    CHECK(splitmix64(1234567, 2) == 9817491932198370423u);
    CHECK(random_bits(mix_bits(1), 5) != random_bits(mix_bits(2), 4));

    double sum = 0, squares = 0, lagged = 0, before = 0;
    constexpr int n = 100000;
    for (int i = 0; i < n; ++i) {
        const double u = unit_interval(random_bits(1, std::uint64_t(i))) - 0.5;
        sum += u;
        squares += u * u;
        lagged += u * before;
        before = u;
    }
    // Four standard deviations of the mean, the variance and the correlation of neighbours.
    CHECK(std::abs(sum / n) < 4 * std::sqrt(1.0 / 12 / n));
    CHECK(std::abs(squares / n - 1.0 / 12) < 4 * std::sqrt(1.0 / 180 / n));
    CHECK(std::abs(lagged / n) < 4.0 / 12 / std::sqrt(n));
    RandomSequence sequence(3);
    std::set<std::uint64_t> seen;
    for (int i = 0; i < 200; ++i) seen.insert(sequence.below(7));
    CHECK(seen.size() == 7);
    CHECK(*seen.rbegin() == 6);
}

TEST_CASE("A box on a lattice: one particle at the centre of each cube, volume exact") {
    const auto flat = sample_box<2>({-1, 2}, {0, 2.5}, {.spacing = 0.25});
    REQUIRE(flat.positions.size() == 8);
    CHECK(flat.positions[0] == Vec<double, 2>{-0.875, 2.125});
    CHECK(flat.positions[1] == Vec<double, 2>{-0.625, 2.125});  // the first axis runs fastest
    CHECK(flat.positions[7] == Vec<double, 2>{-0.125, 2.375});
    CHECK(total_volume(flat) == 0.5);

    const auto cube = sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 0.1});
    CHECK(cube.positions.size() == 1000);
    CHECK(total_volume(cube) == Approx(1).epsilon(1e-14));
    // No multiple of the spacing: layers whose centres lie inside, 0.1 to 0.9 and 0.1 to 1.1 of 1.2.
    CHECK(sample_box<2>({0, 0}, {1, 1.2}, {.spacing = 0.2}).positions.size() == 30);
    CHECK(sample_box<2>({0, 0}, {0.99, 1.11}, {.spacing = 0.2}).positions.size() == 30);
    CHECK(sample_box<2>({0, 0}, {0.89, 1.09}, {.spacing = 0.2}).positions.size() == 20);
}

TEST_CASE("A jittered box keeps each particle in its cube, all of them, and fills the jitter's range") {
    const SamplingOptions options{.spacing = 0.1, .pattern = Pattern::jittered, .jitter = 0.3, .seed = 5};
    const auto lattice = sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 0.1}).positions;
    const auto jittered = sample_box<3>({0, 0, 0}, {1, 1, 1}, options);
    REQUIRE(jittered.positions.size() == lattice.size());
    CHECK(total_volume(jittered) == Approx(1).epsilon(1e-14));
    double most = 0, mean = 0;
    for (std::size_t i = 0; i < lattice.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            const double moved = (jittered.positions[i][k] - lattice[i][k]) / 0.1;
            most = std::max(most, std::abs(moved));
            mean += moved / 3000;
        }
    }
    CHECK(most <= 0.3 * (1 + 1e-12));
    CHECK(most > 0.3 * 0.99);
    CHECK(std::abs(mean) < 4 * 0.3 / std::sqrt(3 * 3000.0));
}

TEST_CASE("lattice_points: the first 72,027 of 42 × 42 × 41 points, as the benchmark's cube has them") {
    const double h = 1.0 / 128;
    const Vec<double, 3> lower{0.3, 0.2, 0.3};
    const auto points = lattice_points<3>(lower, {42, 42, 41}, h / 2, 0.1, 1, 72027);
    REQUIRE(points.size() == 72027);
    const auto all = lattice_points<3>(lower, {42, 42, 41}, h / 2, 0.1, 1);
    REQUIRE(all.size() == 42 * 42 * 41);
    CHECK(std::equal(points.begin(), points.end(), all.begin()));
    const auto regular = lattice_points<3>(lower, {42, 42, 41}, h / 2);
    double most = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        for (int k = 0; k < 3; ++k) most = std::max(most, std::abs(all[i][k] - regular[i][k]));
    }
    CHECK(most <= 0.05 * h * (1 + 1e-9));  // a jitter of 0.1 spacings of h/2
    CHECK(most > 0.0499 * h);
    CHECK(regular[42 * 42 * 40][2] == Approx(0.3 + 40.5 * h / 2));
    CHECK(lattice_points<2>({0, 0}, {3, 2}, 1.0, 0, 1, 0).empty());

    CHECK_THROWS_AS(lattice_points<3>(lower, {42, 0, 41}, h), parameter_error);
    CHECK_THROWS_AS(lattice_points<3>(lower, {2, 2, 2}, h, 0, 1, 9), parameter_error);
    CHECK_THROWS_AS(lattice_points<3>(lower, {2, 2, 2}, 0), parameter_error);
    CHECK_THROWS_AS(lattice_points<3>(lower, {2, 2, 2}, h, 0.6), parameter_error);
    CHECK_THROWS_AS(lattice_points<3>({0, not_a_number, 0}, {2, 2, 2}, h), parameter_error);
    CHECK(holds(message<parameter_error>([] { lattice_points<2>({0, 0}, {1 << 30, 1 << 30}, 1.0); }),
                "1.1529215e+18 particles"));
}

TEST_CASE("Disks and spheres: symmetric about the centre, volume within a tenth of what the surface cuts") {
    // 316 points with half-odd coordinates lie in a circle of radius 10 (Gauss's circle problem, shifted).
    const auto disk = sample_sphere<2>({3, -1}, 0.25, {.spacing = 0.025});
    CHECK(disk.positions.size() == 316);
    Vec<double, 2> centre{};
    for (const auto& x : disk.positions) centre += x * (1.0 / 316);
    CHECK(centre[0] == Approx(3).epsilon(1e-14));
    CHECK(centre[1] == Approx(-1).epsilon(1e-14));

    for (const auto pattern : {Pattern::lattice, Pattern::jittered}) {
        for (const double spacing : {0.2, 0.1, 0.05}) {
            const auto ball = sample_sphere<3>({0, 0, 0}, 1, {.spacing = spacing, .pattern = pattern});
            CAPTURE(spacing, int(pattern));
            CHECK(std::abs(total_volume(ball) - 4.0 / 3 * pi) < 0.1 * spacing * 4 * pi);
            for (const auto& x : ball.positions) REQUIRE(norm(x) <= 1 + 1e-15);
        }
    }
    const auto scattered = sample_sphere<3>({0, 0, 0}, 1, {.spacing = 0.1, .pattern = Pattern::poisson_disk});
    CHECK(total_volume(scattered) == Approx(4.0 / 3 * pi).epsilon(1e-14));
}

TEMPLATE_TEST_CASE_SIG("Poisson-disk: never closer than the radius, no large hole, as dense as the lattice", "",
                       ((int D), D), 2, 3) {
    const double side = D == 2 ? 30 : 11;
    const auto lower = Vec<double, D>::filled(-2), upper = Vec<double, D>::filled(side - 2);
    const double radius = poisson_radius<D>(1);
    const auto samples = sample_box<D>(lower, upper, {.spacing = 1, .pattern = Pattern::poisson_disk, .seed = 3});
    // Positions are rounded once: a few units in the last place of the box.
    CHECK(least_distance<D>(samples.positions) >= radius * (1 - 1e-14));
    CHECK(least_distance<D>(samples.positions) < radius * 1.01);
    // A maximal set leaves no place further than r from a point; thirty candidates and the cut at the box leave little.
    const auto inner = Vec<double, D>::filled(test_support::fewer_if_quick(2.0, D == 2 ? 2.0 : 4.0));
    CHECK(widest_hole<D>(samples.positions, lower + inner, upper - inner, radius) < 1.25 * radius);
    CHECK(total_volume(samples) == Approx(std::pow(side, D)).epsilon(1e-14));
    for (const auto& x : samples.positions) {
        for (int k = 0; k < D; ++k) REQUIRE((x[k] >= -2 && x[k] <= side - 2));
    }
    // As many as the lattice, within 1 %: over a box wide enough that chance does not show.
    if (test_support::quick && D == 3) return;
    const double wide = D == 2 ? 150 : 30;
    const auto many = sample_box<D>(Vec<double, D>::zero(), Vec<double, D>::filled(wide),
                                    {.spacing = 1, .pattern = Pattern::poisson_disk});
    CHECK(double(many.positions.size()) == Approx(std::pow(wide, D)).epsilon(0.01));
}

TEST_CASE("The same seed gives the same bits, stored ones; another seed gives others") {
    const auto of = [](Pattern pattern, std::uint64_t seed) {
        const SamplingOptions options{.spacing = 0.15, .pattern = pattern, .seed = seed};
        return hash<3>(sample_sphere<3>({0.1, 0.2, 0.3}, 1, options).positions);
    };
    for (const auto pattern : {Pattern::jittered, Pattern::poisson_disk}) {
        CHECK(of(pattern, 1) == of(pattern, 1));
        CHECK(of(pattern, 1) != of(pattern, 2));
    }
    CHECK(of(Pattern::lattice, 1) == of(Pattern::lattice, 2));
    // Positions do not depend on the compiler, on optimisation or on FMA: every build holds these.
    CHECK(of(Pattern::lattice, 1) == 0x11ab68b604578e23u);
    CHECK(of(Pattern::jittered, 1) == 0x0e7b631830e5aa40u);
    CHECK(of(Pattern::poisson_disk, 1) == 0x354d52f26fc4931cu);
}

TEST_CASE("The bunny filled: total volume within a stated bound of the enclosed one, all particles inside") {
    const auto bunny = fitted(read_obj(FIRN_TEST_EXAMPLES_DIR "/data/bunny.obj"), {0.5, 0.5, 0.5}, 0.3);
    const InsideTest inside(bunny);
    const double volume = signed_volume(bunny);
    const double spacing = std::cbrt(volume / 20000);
    for (const auto pattern : {Pattern::lattice, Pattern::jittered, Pattern::poisson_disk}) {
        const auto samples = sample_mesh(bunny, {.spacing = spacing, .pattern = pattern});
        CAPTURE(int(pattern), samples.positions.size());
        // The lattice's error is that of counting the cubes that a curved surface cuts.
        CHECK(total_volume(samples) == Approx(volume).epsilon(pattern == Pattern::poisson_disk ? 1e-12 : 3e-3));
        CHECK(double(samples.positions.size()) == Approx(20000).epsilon(0.01));
        for (const auto& x : samples.positions) REQUIRE(inside(x));
    }
}

TEST_CASE("Overlapping bodies in one mesh are filled once, and share the volume of their union") {
    // Two unit cubes that overlap by half: the union's volume is 1.5, the signed volume 2.
    const auto mesh = joined(unit_cube(), box({0.5, 0, 0}, {1.5, 1, 1}));
    const auto lattice = sample_mesh(mesh, {.spacing = 0.05});
    CHECK(lattice.positions.size() == 30 * 20 * 20);
    CHECK(total_volume(lattice) == Approx(1.5).epsilon(1e-12));
    const auto scattered = sample_mesh(mesh, {.spacing = 0.05, .pattern = Pattern::poisson_disk});
    CHECK(total_volume(scattered) == Approx(1.5).epsilon(0.01));
    // Parts that do not touch are all filled.
    const auto apart = joined(unit_cube(), box({5, 5, 5}, {6, 6, 6}));
    const auto both = sample_mesh(apart, {.spacing = 0.2, .pattern = Pattern::poisson_disk});
    const auto in_first = std::count_if(both.positions.begin(), both.positions.end(), [](auto& x) { return x[0] < 2; });
    CHECK(double(in_first) == Approx(double(both.positions.size()) / 2).epsilon(0.15));
    CHECK(total_volume(both) == Approx(2).epsilon(1e-12));
}

TEST_CASE("Spacing for a number of particles per cell") {
    CHECK(particle_spacing<3>(0.1, 8) == Approx(0.05).epsilon(1e-15));
    CHECK(particle_spacing<2>(0.1, 4) == Approx(0.05).epsilon(1e-15));
    CHECK_THROWS_AS(particle_spacing<3>(0.1, 0), parameter_error);
    CHECK_THROWS_AS(particle_spacing<3>(-0.1, 8), parameter_error);
    CHECK_THROWS_AS(particle_spacing<3>(not_a_number, 8), parameter_error);
}

TEST_CASE("What cannot be filled is refused, with what to do") {
    const Vec<double, 3> zero{}, one{1, 1, 1};
    const SamplingOptions good{.spacing = 0.1};
    SECTION("spacing and jitter") {
        for (const double spacing : {0.0, -0.1, not_a_number, std::numeric_limits<double>::infinity()}) {
            CHECK_THROWS_AS(sample_box(zero, one, {.spacing = spacing}), parameter_error);
            CHECK_THROWS_AS(sample_sphere(zero, 1, {.spacing = spacing}), parameter_error);
            CHECK_THROWS_AS(sample_mesh(unit_cube(), {.spacing = spacing}), parameter_error);
        }
        for (const double jitter : {-0.1, 0.51, not_a_number}) {
            CHECK_THROWS_AS(sample_box(zero, one, {.spacing = 0.1, .jitter = jitter}), parameter_error);
        }
        CHECK(holds(message<parameter_error>([&] { return sample_box(zero, one, {}); }), "must be given"));
    }
    SECTION("shapes") {
        CHECK_THROWS_AS(sample_box(one, zero, good), parameter_error);
        CHECK_THROWS_AS(sample_box(zero, {1, 0, 1}, good), parameter_error);
        CHECK_THROWS_AS(sample_box({0, not_a_number, 0}, one, good), parameter_error);
        CHECK_THROWS_AS(sample_box(zero, {1, std::numeric_limits<double>::infinity(), 1}, good), parameter_error);
        CHECK_THROWS_AS(sample_sphere(zero, 0, good), parameter_error);
        CHECK_THROWS_AS(sample_sphere(zero, -1, good), parameter_error);
        CHECK_THROWS_AS(sample_sphere(zero, not_a_number, good), parameter_error);
        CHECK_THROWS_AS(sample_sphere<3>({0, 0, not_a_number}, 1, good), parameter_error);
        auto open = unit_cube();
        open.triangles.pop_back();
        CHECK_THROWS_AS(sample_mesh(open, good), mesh_error);
        CHECK_THROWS_AS(poisson_disk_points<3>(zero, one, 0), parameter_error);
        CHECK_THROWS_AS(poisson_disk_points<3>(one, zero, 0.1), parameter_error);
        CHECK_THROWS_AS(poisson_disk_points<3>(zero, one, 0.1, 1, 1e9, 0), parameter_error);
    }
    SECTION("no particle inside") {
        CHECK(holds(message<parameter_error>([&] { return sample_sphere(zero, 0.01, good); }),
                    "the spacing of 0.1 m is too large"));
        const auto small = scaled(unit_cube(), 0.01);
        CHECK(holds(message<parameter_error>([&] { return sample_mesh(small, good); }),
                    "No particle falls inside the mesh"));
        CHECK_THROWS_AS(sample_box(zero, {0.04, 1, 1}, good), parameter_error);
    }
    SECTION("too many particles, said before memory is asked for") {
        CHECK(holds(
            message<parameter_error>([&] { return sample_box(zero, one, {.spacing = 1e-2, .max_particles = 999999}); }),
            "about 1000000 particles; at most 999999"));
        CHECK_THROWS_AS(sample_sphere(zero, 1, {.spacing = 1e-200}), parameter_error);
        CHECK_THROWS_AS(sample_mesh(unit_cube(), {.spacing = 0.1, .max_particles = 999}), parameter_error);
        CHECK_NOTHROW(sample_mesh(unit_cube(), {.spacing = 0.1, .max_particles = 1001}));
        // A sheet has few particles, but the box around a slanted one has many places to try.
        const auto sheet = rotated(box({0, 0, 0}, {1, 1, 1e-9}), rotation({1, 1, 0}, 0.7));
        CHECK(holds(message<parameter_error>([&] { return sample_mesh(sheet, {.spacing = 1e-5}); }),
                    "lattice points to try"));
        CHECK_THROWS_AS(poisson_disk_points<3>(zero, one, 1e-6), parameter_error);
    }
}

}  // namespace sampling_tests
