// sanitized: -O1
// quick: -O1
/// \file firn/data/surface.hpp: the surface of particles is closed, encloses their volume, has no holes, has the same
/// bits on any number of threads and in any order of the particles, and carries fields.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/data/surface.hpp>

#include <map>
#include <numeric>
#include <random>

using namespace firn;
using test_support::check_refused;

namespace surface_tests {
namespace {

using Point = Vec<double, 3>;
using Points = std::vector<Point>;

/// Points of a lattice of boxes, each moved at random by up to half of `jitter` spacings along each axis.
Points lattice(const std::array<int, 3>& count, double spacing, double jitter = 0, const Point& at = {}) {
    std::mt19937 random(7);
    const auto number = [&] { return jitter * (double(random()) / 4294967296.0 - 0.5); };
    Points points;
    for (int k = 0; k < count[2]; ++k)
        for (int j = 0; j < count[1]; ++j)
            for (int i = 0; i < count[0]; ++i) {
                Point x{i + 0.5, j + 0.5, k + 0.5};
                for (double& c : x.v) c += number();
                points.push_back(at + x * spacing);
            }
    return points;
}
std::vector<double> cubed(double spacing) { return {spacing * spacing * spacing}; }

/// Returns the number of shells of a closed mesh, and V − E + F, which is twice this number if no shell has a hole.
std::pair<std::size_t, std::ptrdiff_t> topology(const TriangleMesh& mesh) {
    std::vector<std::size_t> parent(mesh.vertices.size());
    std::iota(parent.begin(), parent.end(), std::size_t(0));
    const auto root = [&](std::size_t v) {
        while (parent[v] != v) v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const auto& t : mesh.triangles)
        for (const std::size_t k : {1u, 2u}) parent[root(std::size_t(t[k]))] = root(std::size_t(t[0]));
    std::size_t shells = 0;
    for (std::size_t v = 0; v < parent.size(); ++v) shells += parent[v] == v;
    return {shells, std::ptrdiff_t(mesh.vertices.size()) - std::ptrdiff_t(mesh.triangles.size() / 2)};
}

/// Checks that a mesh is closed and that the triangles around each vertex form one fan.
void check_manifold(const TriangleMesh& mesh) {
    CHECK_NOTHROW(check_closed(mesh));
    std::vector<std::map<std::int32_t, std::int32_t>> next(mesh.vertices.size());  // around each vertex
    for (const auto& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) next[std::size_t(t[k])][t[(k + 1) % 3]] = t[(k + 2) % 3];
    std::size_t wrong = 0;
    for (const auto& fan : next) {
        std::size_t length = 0;
        if (!fan.empty()) {
            auto v = fan.begin()->first;
            do {
                const auto found = fan.find(v);
                if (found == fan.end()) break;
                v = found->second;
                ++length;
            } while (v != fan.begin()->first && length <= fan.size());
        }
        wrong += fan.empty() || length != fan.size();
    }
    CHECK(wrong == 0);
}

std::vector<double> numbers_of(const SurfaceMesh& surface) {
    std::vector<double> numbers;
    for (const auto& vectors : {surface.vertices, surface.normals})
        for (const auto& x : vectors) numbers.insert(numbers.end(), x.v, x.v + 3);
    for (const auto& field : surface.fields) numbers.insert(numbers.end(), field.values.begin(), field.values.end());
    return numbers;
}
bool same(const SurfaceMesh& a, const SurfaceMesh& b) {
    return a.triangles == b.triangles && numbers_of(a) == numbers_of(b);
}

/// Blocks with given values, for the extraction alone.
struct Values {
    static constexpr int side = 8;
    static constexpr std::size_t nodes = 512;
    std::map<detail::BoxIndex, std::size_t> found;
    std::vector<detail::BoxIndex> at;
    std::vector<float> all;

    static std::size_t node(int i, int j, int k) { return std::size_t(i + side * (j + side * k)); }
    double cell() const { return 1; }
    int threads() const { return 1; }
    std::size_t blocks() const { return at.size(); }
    detail::BoxIndex block(std::size_t b) const { return at[b]; }
    const float* values(std::size_t b) const { return all.data() + nodes * b; }
    std::array<std::size_t, 8> from(const detail::BoxIndex& first) const {
        std::array<std::size_t, 8> near{};
        for (std::size_t n = 0; n < 8; ++n) {
            const auto entry = found.find({first[0] + int(n & 1), first[1] + int(n >> 1 & 1), first[2] + int(n >> 2)});
            near[n] = entry == found.end() ? blocks() : entry->second;
        }
        return near;
    }
};

}  // namespace

TEST_CASE("Marching cubes of any values are closed, oriented and manifold", "[surface]") {
    std::mt19937 random(3);
    for (const int ones : {1, 4, 8, 12, 15}) {  // of 16 nodes inside: all cases of cells beside all others
        Values values;
        for (int b = 0; b < 27; ++b) {
            const detail::BoxIndex at{b % 3, b / 3 % 3, b / 9};
            values.found[at] = values.at.size();
            values.at.push_back(at);
            for (std::size_t n = 0; n < Values::nodes; ++n) {
                const int i = int(n) % 8, j = int(n) / 8 % 8, k = int(n) / 64;
                const bool edge = (at[0] == 0 && i == 0) || (at[1] == 0 && j == 0) || (at[2] == 0 && k == 0);
                const bool end = (at[0] == 2 && i == 7) || (at[1] == 2 && j == 7) || (at[2] == 2 && k == 7);
                const bool inside = !edge && !end && int(random() >> 5) % 16 < ones;
                values.all.push_back(inside ? 0.5F + 0.4F * float(random() % 1000) / 1000 + 1e-3F : 0.0F);
            }
        }
        std::vector<std::uint32_t> block_of;
        const auto mesh = detail::SurfaceExtraction<Values>(values, 0.5).mesh(block_of);
        CAPTURE(ones, mesh.triangles.size());
        CHECK(mesh.triangles.size() > 2000);
        check_manifold(mesh);
        CHECK(signed_volume(mesh) > 0);
    }
}

TEST_CASE("The surface of a cloud is closed and manifold at any density", "[surface]") {
    std::mt19937 random(5);
    const auto number = [&] { return double(random()) / 4294967296.0; };
    for (const int count : {1, 2, 3, 10, 100, 1000, 4000}) {
        Points points;
        std::vector<double> volumes;
        std::vector<Mat<double, 3>> F;
        for (int k = 0; k < count; ++k) {
            points.push_back({number(), number(), 100 + number()});
            volumes.push_back(1e-3 * (0.3 + number()));
            Mat<double, 3> gradient = Mat<double, 3>::identity();
            for (double& entry : gradient.m) entry += 3 * (number() - 0.5);
            F.push_back(gradient);
        }
        for (const bool has_F : {false, true}) {
            SurfaceParticles particles{points, volumes};
            if (has_F) particles.deformation_gradients = F;
            const auto surface = surface_of(particles, {.cell_size = 0.03, .smoothing = count % 3});
            CAPTURE(count, has_F);
            REQUIRE(surface.triangles.size() >= 8);
            check_manifold(surface);
            CHECK(signed_volume(surface) > 0);
            CHECK(surface.normals.size() == surface.vertices.size());
        }
    }
}

TEST_CASE("A surface encloses the volume of the particles", "[surface]") {
    // A cube of 16 cells with 8 particles a cell, at rest, on the lattice and at random places in their boxes.
    constexpr double spacing = 0.05;
    for (const double jitter : {0.0, 0.5, 1.0}) {
        const auto points = lattice({32, 32, 32}, spacing, jitter, {0.0123, 0.04, -0.007});
        const double volume = double(points.size()) * cubed(spacing)[0];
        for (const int smoothing : {0, 2, 6}) {
            const auto surface = surface_of({points, cubed(spacing)}, {.smoothing = smoothing});
            CAPTURE(jitter, smoothing);
            CHECK(signed_volume(surface) == Approx(volume).epsilon(0.02));
            CHECK(topology(surface).first == 1);
            if (jitter < 1) CHECK(topology(surface).second == 2);  // at random, it may have small handles
            CHECK(surface.alone.empty());
        }
    }
    // Its faces lie where the matter ends, and its normals look outwards.
    const auto surface = surface_of({lattice({32, 32, 32}, spacing), cubed(spacing)});
    for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
        const auto& x = surface.vertices[v];
        const auto inner = [](double c) { return c > 0.3 && c < 1.3; };
        if (!inner(x[1]) || !inner(x[2])) continue;
        const bool right = x[0] > 0.8;
        if (std::abs(x[0] - (right ? 1.6 : 0)) > 0.2 * spacing || (right ? 1 : -1) * surface.normals[v][0] < 0.999)
            FAIL_CHECK("vertex " << v << " at " << x[0] << " has the normal " << surface.normals[v][0]);
    }
}

TEST_CASE("Small cavities are filled, large ones are not", "[surface]") {
    constexpr double spacing = 0.05;
    const auto points = lattice({32, 32, 32}, spacing, 1);
    const auto shells = [&](const Points& of, double filled) {
        return topology(surface_of({of, cubed(spacing)}, {.radius = 2, .filled = filled})).first;
    };
    CHECK(shells(points, 0) > 10);
    CHECK(shells(points, 8) == 1);
    auto hollow = lattice({24, 24, 24}, spacing);
    std::erase_if(hollow, [&](const Point& x) { return norm(x - Point::filled(12 * spacing)) < 4 * spacing; });
    const double hole = double(24 * 24 * 24) - double(hollow.size());  // volumes of particles
    const auto surface = surface_of({hollow, cubed(spacing)});
    CHECK(topology(surface).first == 2);
    CHECK(signed_volume(surface) == Approx(double(hollow.size()) * cubed(spacing)[0]).epsilon(0.02));
    CHECK(shells(hollow, 0.7 * hole) == 2);
    CHECK(shells(hollow, 1.3 * hole) == 1);
}

TEST_CASE("Stretched matter has no holes where F is known", "[surface]") {
    constexpr double spacing = 0.1, stretch = 2.2;
    Mat<double, 3> F = Mat<double, 3>::identity();
    F(0, 0) = F(1, 1) = stretch, F(2, 2) = 1 / (stretch * stretch);
    const auto turned = rotation({1, 2, 3}, 0.7) * F;
    Points points;
    for (const auto& x : lattice({16, 16, 4}, spacing)) points.push_back(turned * x);
    const std::vector<Mat<double, 3>> gradients(points.size(), turned);
    const auto volume = cubed(spacing);
    SurfaceParticles particles{points, volume};
    const SurfaceOptions options{.cell_size = 0.04, .largest_stretch = 5};
    const auto without = topology(surface_of(particles, options));
    CHECK(without != std::pair(std::size_t(1), std::ptrdiff_t(2)));  // the plate has fallen apart
    particles.deformation_gradients = gradients;
    const auto surface = surface_of(particles, options);
    CHECK(topology(surface) == std::pair(std::size_t(1), std::ptrdiff_t(2)));
    CHECK(signed_volume(surface) == Approx(double(points.size()) * cubed(spacing)[0]).epsilon(0.06));
    CHECK(topology(surface_of(particles, {.cell_size = 0.04})) == topology(surface));  // F is not believed, but enough
}

TEST_CASE("Extreme stretches are not believed", "[surface]") {
    const auto of = [](double a, double b, double c) { return Mat<double, 3>::rows(a, 0, 0, 0, b, 0, 0, 0, c); };
    const auto differ = [](const Mat<double, 3>& a, const Mat<double, 3>& b) { return std::sqrt(squared_norm(a - b)); };
    CHECK(differ(detail::believed(of(1.3, 0.9, 1), 2), of(1.3, 0.9, 1)) < 1e-12);
    // By hand: of diag(100, 1, 1/100) the volume is 1, and the stretches are cut to 2, 1 and 1/2.
    CHECK(differ(detail::believed(of(100, 1, 0.01), 2), of(2, 1, 0.5)) < 1e-12);
    const auto turn = rotation({1, -2, 0.5}, 0.8);
    CHECK(differ(detail::believed(turn * of(100, 1, 0.01), 2), turn * of(2, 1, 0.5)) < 1e-12);
    // Of diag(4, 4, 4) the volume is cut to 2.
    CHECK(differ(detail::believed(of(4, 4, 4), 2), of(1, 1, 1) * std::cbrt(2.0)) < 1e-12);
    // Of a matrix without an inverse, and of one that mirrors.
    for (const auto& F : {of(0, 1, 1), of(0, 0, 1), of(0, 0, 0)})
        CHECK(determinant(detail::believed(F, 2)) == Approx(0.5).epsilon(1e-9));
    CHECK(std::abs(determinant(detail::believed(of(-1, 1, 1), 2))) == Approx(1).epsilon(1e-9));
}

TEST_CASE("Matter that F compresses has its volume", "[surface]") {
    Mat<double, 3> F = Mat<double, 3>::identity() * 0.9;
    Points points = lattice({20, 20, 20}, 0.9 * 0.1);
    const std::vector<Mat<double, 3>> gradients(points.size(), F);
    const auto surface = surface_of({points, cubed(0.1), gradients});
    CHECK(signed_volume(surface) == Approx(8 * 0.729).epsilon(0.03));
}

TEST_CASE("Drops, strands and sheets do not vanish", "[surface]") {
    constexpr double spacing = 0.1;
    const auto share = [&](const std::array<int, 3>& count) {
        const auto points = lattice(count, spacing, 0.2, {0.013, 0.37, 0.21});
        const auto surface = surface_of({points, cubed(spacing)});
        return std::pair(signed_volume(surface) / (double(points.size()) * cubed(spacing)[0]), topology(surface).first);
    };
    const auto drop = share({1, 1, 1}), strand = share({40, 1, 1}), sheet = share({20, 20, 1}), few = share({3, 3, 3});
    CAPTURE(drop.first, strand.first, sheet.first, few.first);
    CAPTURE(drop.second, strand.second, sheet.second, few.second);
    CHECK(drop.first > 0.25);
    CHECK(strand.first > 0.6);
    CHECK(sheet.first > 0.75);
    CHECK(few.first > 0.5);  // small drops lose some, as every level of a smooth field does
    for (const auto& each : {drop, strand, sheet, few}) {
        CHECK(each.first < 1.15);
        CHECK(each.second == 1);
    }
}

TEST_CASE("Particles without neighbours are named, and can be left out", "[surface]") {
    constexpr double spacing = 0.1;
    auto points = lattice({8, 8, 8}, spacing);
    points.insert(points.begin() + 100, {2, 0, 0});
    points.push_back({2, 2, 0});
    auto surface = surface_of({points, cubed(spacing)});
    CHECK(surface.alone == std::vector<std::uint32_t>{100, std::uint32_t(points.size() - 1)});
    CHECK(topology(surface).first == 3);
    surface = surface_of({points, cubed(spacing)}, {.separate = false});
    CHECK(surface.alone.size() == 2);
    CHECK(topology(surface).first == 1);
    const Points drop{{1, 1, 1}};
    surface = surface_of({drop, cubed(spacing)}, {.separate = false});
    CHECK(surface.triangles.empty());
    CHECK(surface.vertices.empty());
}

TEST_CASE("A surface has the same bits on any number of threads and in any order of the particles", "[surface]") {
    constexpr double spacing = 0.1;
    auto points = lattice({24, 18, 12}, spacing, 1.0);
    std::vector<double> volumes;
    std::vector<Mat<double, 3>> F;
    SurfaceField velocity{"velocity", "m/s", 3, {}};
    std::mt19937 random(2);
    for (std::size_t k = 0; k < points.size(); ++k) {
        if (k % 50 == 1) points[k] = points[k - 1];  // two at one place
        volumes.push_back(cubed(spacing)[0] * (1 + 1e-3 * double(k % 7)));
        Mat<double, 3> gradient = Mat<double, 3>::identity();
        for (double& entry : gradient.m) entry += 1e-4 * double(random() % 1000);
        F.push_back(gradient);
        for (int a = 0; a < 3; ++a) velocity.values.push_back(points[k][a] * (1 + a));
    }
    const std::vector<SurfaceField> fields{velocity};
    const auto expected = surface_of({points, volumes, F, fields}, {.threads = 1});
    REQUIRE(expected.triangles.size() > 5000);
    for (const int threads : {2, 4, 7})
        CHECK(same(surface_of({points, volumes, F, fields}, {.threads = threads}), expected));

    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::shuffle(order.begin(), order.end(), random);
    Points moved;
    std::vector<double> moved_volumes;
    std::vector<Mat<double, 3>> moved_F;
    std::vector<SurfaceField> moved_fields{{"velocity", "m/s", 3, {}}};
    for (const auto k : order) {
        moved.push_back(points[k]);
        moved_volumes.push_back(volumes[k]);
        moved_F.push_back(F[k]);
        for (std::size_t a = 0; a < 3; ++a) moved_fields[0].values.push_back(velocity.values[3 * k + a]);
    }
    CHECK(same(surface_of({moved, moved_volumes, moved_F, moved_fields}, {.threads = 3}), expected));
    moved[5][0] += 1e-3;  // the comparison can fail
    CHECK(!same(surface_of({moved, moved_volumes, moved_F, moved_fields}), expected));
}

TEST_CASE("A surface carries fields", "[surface]") {
    constexpr double spacing = 0.1;
    const auto points = lattice({16, 16, 16}, spacing, 0.6);
    const Point gradient{0.3, -0.7, 0.5};
    std::vector<SurfaceField> fields{{"linear", "K", 1, {}}, {"constant", "m/s", 2, {}}};
    for (const auto& x : points) {
        fields[0].values.push_back(dot(gradient, x));
        fields[1].values.push_back(0.1);
        fields[1].values.push_back(-3);
    }
    const auto surface = surface_of({points, cubed(spacing), {}, fields}, {.smoothing = 0});
    REQUIRE(surface.fields.size() == 2);
    CHECK(surface.fields[0].name == "linear");
    CHECK(surface.fields[0].unit == "K");
    REQUIRE(surface.fields[0].values.size() == surface.vertices.size());
    REQUIRE(surface.fields[1].values.size() == 2 * surface.vertices.size());
    double worst = 0, across = 0;
    for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
        const double error = surface.fields[0].values[v] - dot(gradient, surface.vertices[v]);
        worst = std::max(worst, std::abs(error));
        // Along a face, particles are on all sides.
        const auto& x = surface.vertices[v];
        if (x[0] < 0.05 && std::min(x[1], x[2]) > 0.3 && std::max(x[1], x[2]) < 1.3)
            across = std::max(across, std::abs(error - gradient[0] * spacing * 0.5));
        CHECK(surface.fields[1].values[2 * v] == Approx(0.1).epsilon(1e-12));
        CHECK(surface.fields[1].values[2 * v + 1] == Approx(-3).epsilon(1e-12));
    }
    // A mean over the particles within a kernel's radius, 3 spacings, errs by less than that times the gradient. On a
    // face the mean lies in the outermost layers of the matter.
    CHECK(worst < 3 * spacing * norm(gradient));
    CHECK(worst < 1.2 * spacing * norm(gradient));
    CHECK(across < 0.6 * spacing * norm(gradient));
}

TEST_CASE("The field and the means on a surface are those of the definition", "[surface]") {
    constexpr double spacing = 0.1;
    auto points = lattice({9, 7, 5}, spacing, 0.6);
    points.push_back({2, 0, 0});
    const auto volume = cubed(spacing);
    std::vector<SurfaceField> fields{{"random", "1", 1, {}}};
    std::mt19937 random(4);
    for (std::size_t k = 0; k < points.size(); ++k) fields[0].values.push_back(double(random() % 1000));
    const SurfaceParticles particles{points, volume, {}, fields};
    const SurfaceOptions options{.cell_size = 0.02, .smoothing = 0};
    const auto surface = surface_of(particles, options);
    const auto ellipsoids = detail::ellipsoids_of(particles, options);
    double integral = 0;
    for (const auto& each : ellipsoids.all) integral += each.volume;
    CHECK(integral == Approx(double(points.size()) * volume[0]).epsilon(1e-9));
    double worst = 0, farthest = 0;
    for (std::size_t v = 0; v < surface.vertices.size(); v += 7) {
        double sum = 0, weighted = 0;
        for (std::size_t e = 0; e < points.size(); ++e) {
            const auto& [centre, B, each_volume] = ellipsoids.all[e];
            const auto matrix = Mat<double, 3>::rows(B[0], B[1], B[2], B[1], B[3], B[4], B[2], B[4], B[5]);
            const auto d = surface.vertices[v] - centre;
            const double rest = 1 - dot(d, detail::inverted(matrix) * d);
            if (rest <= 0) continue;
            const double w =
                315 / (64 * std::acos(-1.0)) * each_volume / std::sqrt(determinant(matrix)) * std::pow(rest, 3);
            sum += w;
            weighted += w * fields[0].values[ellipsoids.particle[e]];
        }
        worst = std::max(worst, std::abs(weighted / sum - surface.fields[0].values[v]));
        farthest = std::max(farthest, std::abs(sum - options.level));
    }
    CHECK(worst < 0.005);    // of 1000, in float
    CHECK(farthest < 0.02);  // a vertex lies where the field is linear along a cell's edge
}

TEST_CASE("Wrong input for a surface is refused", "[surface]") {
    const auto points = lattice({4, 4, 4}, 0.1);
    const auto refused = [&](const SurfaceOptions& options, const std::string& part) {
        check_refused<parameter_error>([&] { surface_of({points, cubed(0.1)}, options); }, part);
    };
    refused({.cell_size = -1}, "cell_size is -1");
    refused({.cell_size = std::nan("")}, "cell_size");
    refused({.radius = 1}, "radius is 1");
    refused({.level = 1}, "level is 1");
    refused({.least_radius = 3.5}, "least_radius is 3.5");
    refused({.largest_stretch = 0.5}, "largest_stretch");
    refused({.smoothing = -1}, "smoothing is -1");
    refused({.threads = -1}, "threads");
    check_refused<memory_error>([&] { surface_of({points, cubed(0.1)}, {.cell_size = 3e-6}); }, "cell_size");
    refused({.cell_size = 1e-9}, "cell_size");

    const Points none;
    check_refused<parameter_error>([&] { surface_of({none, cubed(0.1)}); }, "no particles");
    const std::vector<double> two{1, 1};
    check_refused<parameter_error>([&] { surface_of({points, two}); }, "2 volumes");
    const std::vector<Mat<double, 3>> one{Mat<double, 3>::identity()};
    check_refused<parameter_error>([&] { surface_of({points, cubed(0.1), one}); }, "1 deformation");
    for (const double volume : {0.0, -1.0, std::nan("")})
        check_refused<particle_error>([&] { surface_of({points, std::vector<double>{volume}}); }, "volume");
    auto wrong = points;
    wrong[17][1] = std::nan("");
    check_refused<particle_error>([&] { surface_of({wrong, cubed(0.1)}); }, "Particle 17");
    wrong[17][1] = 1e9;
    check_refused<parameter_error>([&] { surface_of({wrong, cubed(0.1)}); }, "too far apart");
    std::vector<Mat<double, 3>> F(points.size(), Mat<double, 3>::identity());
    F[3](1, 2) = std::numeric_limits<double>::infinity();
    check_refused<particle_error>([&] { surface_of({points, cubed(0.1), F}); }, "particle 3");
    F[3] = Mat<double, 3>::zero();  // F means nothing, but is a number
    check_manifold(surface_of({points, cubed(0.1), F}));
    std::vector<SurfaceField> fields{{"heat", "K", 1, std::vector<double>(63)}};
    check_refused<parameter_error>([&] { surface_of({points, cubed(0.1), {}, fields}); }, "63 values");
    fields[0].values.resize(64);
    fields[0].values[9] = std::nan("");
    check_refused<particle_error>([&] { surface_of({points, cubed(0.1), {}, fields}); }, "'heat'");
}

}  // namespace surface_tests
