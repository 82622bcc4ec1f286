// sanitized: no
/// \file Particle shifting: by definition, never into a wall or a solid, and only where matter is too dense.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include <firn/firn.hpp>

#include <cmath>
#include <cstring>
#include <map>
#include <random>

using namespace firn;

namespace shifting_tests {
namespace {

const auto no_copies = [](auto&, int) {};

/// Particles of a fluid on a grid, and one pass.
template <int D, class S, class Kernel = QuadraticBSpline>
struct Water {
    using State = material_state_t<Fluid<S>, D>;
    Domain<D> domain;
    Fluid<S> fluid;
    Particles<S, D, State> particles{domain};
    BlockPartition<D> partition;
    SparseGrid<S, D> grid{domain};
    bool stray = false;

    explicit Water(const Domain<D>& of) : domain(of), particles(of), grid(of) {}
    void add(const Vec<double, D>& x, double J, double volume) {
        State state = initial_state<D>(fluid);
        state.J = S(J);
        particles.push_back(x, Vec<S, D>::filled(S(0.5)), S(1), S(volume), state);
    }
    template <class Boundary, class Execution = Coloured>
    void pass(const Boundary& boundary, S share, bool sorts = true, const Execution& execution = {2}) {
        if (sorts) partition = sort_particles<Kernel>(particles);
        if (sorts) grid.activate(partition);
        FilterMemory<S> memory;
        const ParticleSet set{particles.view(), partition};
        find_present_volumes<Fluid<S>>(execution, memory, 0, set);
        const auto shift = [&](auto all) {
            return shift_particles<Kernel>(execution, grid, memory, boundary, share, no_copies, {true}, all);
        };
        stray = firn::detail::with_sets(shift, set)[0];
    }
    /// x by id
    std::map<std::uint32_t, Vec<double, D>> positions() const {
        std::map<std::uint32_t, Vec<double, D>> all;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) all[particles.id(slot)] = particles.exact_position(slot);
        return all;
    }
};

/// The weight of a node at the distance u from a particle [cells], and its derivative.
template <class Kernel>
std::array<double, 2> weight(double u) {
    const double base = std::floor(u - Kernel::base_shift), f = u - base;
    const int k = int(-base);
    if (k < 0 || k >= Kernel::support) return {0, 0};
    return {Kernel::weights(f)[std::size_t(k)], Kernel::gradients(f)[std::size_t(k)]};
}

/// Σ over the particles, the excess of each node, and the shift of each particle, by definition in a box of n cells.
template <class Kernel, int D>
std::vector<Vec<double, D>> by_definition(const std::vector<Vec<double, D>>& x, const std::vector<double>& volumes,
                                          int n, double share) {
    const auto product = [](const auto& of_axis, int derived) {
        double value = 1;
        for (int a = 0; a < D; ++a) value *= of_axis[std::size_t(a)][a == derived ? 1 : 0];
        return value;
    };
    std::vector<Vec<double, D>> shifts(x.size(), Vec<double, D>::zero());
    std::vector<double> excess(x.size()), room(x.size());
    std::vector<Vec<double, D>> of_excess = shifts, of_room = shifts;
    std::array<int, D> node{};
    node.fill(-2);
    while (node[D - 1] <= n + 2) {
        double volume = 0, free = 1;
        std::vector<std::array<std::array<double, 2>, D>> weights(x.size());
        for (std::size_t p = 0; p < x.size(); ++p) {
            for (int a = 0; a < D; ++a) weights[p][std::size_t(a)] = weight<Kernel>(x[p][a] - node[std::size_t(a)]);
            volume += product(weights[p], -1) * volumes[p];
        }
        for (const int k : node) {  // the integral of the weight over the box, by midpoints
            double sum = 0;
            for (int i = 0; i < 1000 * n; ++i) sum += weight<Kernel>((i + 0.5) / 1000 - k)[0] / 1000;
            free *= sum;
        }
        const double beyond = std::max(volume - free, 0.0);
        for (std::size_t p = 0; p < x.size(); ++p) {
            excess[p] += product(weights[p], -1) * beyond;
            room[p] += product(weights[p], -1) * free;
            for (int a = 0; a < D; ++a) {
                of_excess[p][a] += product(weights[p], a) * beyond;
                of_room[p][a] += product(weights[p], a) * free;
            }
        }
        for (int a = 0; a < D; ++a) {
            if (++node[std::size_t(a)] <= n + 2 || a == D - 1) break;
            node[std::size_t(a)] = -2;
        }
    }
    for (std::size_t p = 0; p < x.size(); ++p)
        for (int a = 0; a < D; ++a) {
            const double way = -0.5 * share * (of_excess[p][a] - excess[p] / room[p] * of_room[p][a]);
            shifts[p][a] = std::clamp(std::clamp(way, -0.25, 0.25), -0.5 * x[p][a], 0.5 * (n - x[p][a]));
        }
    return shifts;
}

}  // namespace

TEMPLATE_TEST_CASE("The room of a node is the integral of its weight", "", QuadraticBSpline, CubicBSpline,
                   CompactQuartic, Linear) {
    for (double t = -2.2; t < 2.3; t += 0.1) {
        double sum = 0;
        for (int i = 0; i < 40000; ++i)
            if (const double u = -2 + (i + 0.5) * 1e-4; u < t) sum += weight<TestType>(u)[0] * 1e-4;
        CHECK(weight_below<TestType>(t) == Approx(sum).margin(2e-4));  // of the cut cell of 1e-4
    }
    CHECK(weight_below<TestType>(0.0) == Approx(0.5).epsilon(1e-14));
    CHECK(weight_below<TestType>(2.0) == Approx(1).epsilon(1e-14));
    CHECK(weight_below<TestType>(-2.0) == 0);
}

TEMPLATE_TEST_CASE_SIG("Particles are shifted as defined, at walls and in corners, and keep all else", "",
                       ((class Kernel, int D), Kernel, D),
                       FIRN_TEST_FIRST_2((QuadraticBSpline, 2), (QuadraticBSpline, 3), (CubicBSpline, 2),
                                         (CompactQuartic, 2), (Linear, 3))) {
    constexpr int n = D == 2 ? 6 : 4;
    const double h = 0.5;
    Water<D, double, Kernel> water({Vec<double, D>::filled(-1), Vec<double, D>::filled(-1 + n * h), h});
    std::mt19937 random(D);
    std::uniform_real_distribution<double> anywhere(0, n);
    std::vector<Vec<double, D>> x;
    std::vector<double> volumes;
    for (int p = 0; p < (D == 2 ? 5 * n * n : 9 * n * n * n); ++p) {
        Vec<double, D> at;
        for (int a = 0; a < D; ++a) at[a] = anywhere(random);
        const double J = 0.9 + 0.03 * (p % 5), volume = D == 2 ? 0.22 : 0.12;
        x.push_back(at), volumes.push_back(J * volume);
        water.add(Vec<double, D>::filled(-1) + at * h, J, volume * std::pow(h, D));
    }
    const double share = 0.4;
    water.pass(NoBoundary{}, share);
    const auto shifts = by_definition<Kernel, D>(x, volumes, n, share);
    double worst = 0, most = 0;
    for (const auto& [id, to] : water.positions())
        for (int a = 0; a < D; ++a) {
            worst = std::max(worst, std::abs((to[a] + 1) / h - x[id][a] - shifts[id][a]));
            most = std::max(most, std::abs(shifts[id][a]));
        }
    CHECK(worst < 2e-5);  // the midpoints of by_definition(), 1000 a cell
    CHECK(most > 0.02);
    for (std::size_t slot = 0; slot < water.particles.slots(); ++slot)
        if (water.particles.is_particle(slot)) {
            CHECK(water.particles.velocity(slot)[0] == 0.5);
            CHECK(water.particles.state(slot).J == 0.9 + 0.03 * double(water.particles.id(slot) % 5));
        }
}

TEST_CASE("Water in a lattice that fills its room is not shifted by a bit, under its own weight or less") {
    const double h = 1.0 / 16;
    Water<2, float> water({{0, 0}, {1, 1}, h});
    const auto samples = sample_box<2>({0, 0}, {1, 0.5}, {.spacing = h / 2});
    for (const auto& x : samples.positions) water.add(x, 1 - 0.05 * (0.5 - x[1]), samples.volume);
    const auto before = water.positions();
    water.pass(Walls<float, 2>::all({0, 0}, {1, 1}, {}), 1);
    CHECK_FALSE(water.stray);
    for (const auto& [id, x] : water.positions())
        for (int a = 0; a < 2; ++a) CHECK(x[a] == before.at(id)[a]);
}

TEMPLATE_TEST_CASE("A pile is spread out: no particle leaves the walls or enters a solid, or moves far", "",
                   FIRN_TEST_PRECISIONS) {
    using S = TestType;
    const double h = 1.0 / 16;
    auto walls = Walls<S, 2>::all({S(0.125), S(0)}, {1, 1}, {Contact::separate, 0.1});  // inside of the domain, too
    walls.at_upper[1].contact = Contact::none;
    Collider<Sphere<S, 2>> ball{.shape = {S(0.15)}, .contact = Contact::slip};
    ball.position = {0.5, 0.2};
    const Collider<Complement<Sphere<S, 2>>> bowl{.shape = {{S(0.6)}}, .position = {0.6, 0.5}};
    const Together boundary(walls, ball, bowl);
    const auto here = on_grid(boundary, h);
    const auto depth = [&](const Vec<double, 2>& x) {
        double deepest = -1;
        solids_around(here, cast<S>(x), S(h),
                      [&](const S& distance, const auto&) { deepest = std::max(deepest, -double(distance)); });
        return deepest;
    };
    Water<2, S> water({{0, 0}, {1, 1}, h});
    std::mt19937 random(7);
    std::normal_distribution<double> near(0, 0.5 * h);
    const auto put = [&](const Vec<double, 2>& middle) {
        for (int placed = 0; placed < 60;) {
            const Vec<double, 2> x{middle[0] + near(random), middle[1] + near(random)};
            if (x[0] < 0.125 || x[0] > 1 || x[1] < 0 || x[1] > 1 || depth(x) > 0) continue;
            water.add(x, 1, h * h / 4);
            ++placed;
        }
    };
    put({0.14, 0.4}), put({0.3, 0.26}), put({0.5, 0.5}), put({0.99, 0.3}), put({0.6, 0.99});
    auto before = water.positions();
    const auto width = [&] {  // of the piles, from their middles
        double sum = 0;
        for (std::uint32_t pile = 0; pile < 5; ++pile) {
            Vec<double, 2> middle{};
            for (std::uint32_t i = 0; i < 60; ++i) middle += before.at(60 * pile + i) * (1.0 / 60);
            for (std::uint32_t i = 0; i < 60; ++i)
                sum += dot(before.at(60 * pile + i) - middle, before.at(60 * pile + i) - middle);
        }
        return std::sqrt(sum / 300);
    };
    int strays = 0;
    for (int k = 0; k < 60; ++k) {
        water.pass(boundary, S(1), k == 0 || water.stray);
        strays += water.stray;
        const auto after = water.positions();
        for (const auto& [id, x] : after) {
            const auto& was = before.at(id);
            CHECK((x[0] >= 0.125 - 1e-6 * h && x[0] <= 1 && x[1] >= 0 && x[1] <= 1));
            CHECK(depth(x) <= std::max(depth(was), 1e-5 * h));
            for (int a = 0; a < 2; ++a) CHECK(std::abs(x[a] - was[a]) <= 0.250001 * h);
        }
        before = after;
    }
    CHECK(strays > 1);         // a pass without sorting then would have thrown
    CHECK(width() > 1.5 * h);  // 60 particles of a quarter of a cell: a disc of them has 1.55 h
}

TEST_CASE("Matter of other sets and other contact groups fills nodes, too") {
    const double h = 1.0 / 16;
    const Domain<2> domain{{0, 0}, {1, 1}, h};
    const auto run = [&](bool other_set, bool other_group) {
        Simulation simulation(domain, Materials(Fluid<double>{}, FixedCorotated<double>{}), VolumeFilter{.every = 1},
                              CoulombContact{});
        simulation.warn = {};
        simulation.gravity = {};
        const auto box = sample_box<2>({0.3, 0.3}, {0.6, 0.6}, {.spacing = h / 2});
        const auto half = sample_box<2>({0.45, 0.3}, {0.6, 0.6}, {.spacing = h / 2});
        simulation.set<0>().add(box, 1000);
        if (other_set) {
            const Body body = simulation.set<1>().add(half, 1000);
            if (other_group) simulation.set<1>().set_contact_group(body, 1);
        }
        simulation.fixed_time_step = 1e-4;
        simulation.step();
        double moved = 0;
        const auto& particles = simulation.set<0>().particles();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) {
                const auto x = particles.exact_position(slot);
                for (int a = 0; a < 2; ++a)
                    moved = std::max(moved, std::abs(x[a] - box.positions[particles.id(slot)][a]) / h);
            }
        return moved;
    };
    // In half of the box there is twice the matter: e falls from 1 to 0 in some two cells, and s is 0.07 dt c/h.
    CHECK(run(false, false) < 1e-12);
    const double in_set = run(true, false), in_group = run(true, true);
    CHECK(in_set > 0.1 * 0.07 * 1e-4 * 10 * 16);
    CHECK(in_group == Approx(in_set).epsilon(1e-9));
}

TEMPLATE_TEST_CASE("Shifting has the same bits for any number of threads", "",
                   FIRN_TEST_FIRST_1(Coloured, FixedPoint<std::int64_t>)) {
    const auto run = [](int threads) {
        const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, 1.0 / 16};
        TestType execution{};
        execution.threads = threads;
        Simulation simulation(domain, Fluid<float>::from_properties({.bulk = 2e4}), execution,
                              VolumeFilter{.every = 2, .shifting = 1});
        simulation.add(sample_box<3>({0, 0, 0}, {0.4, 0.5, 0.4}, {.spacing = 1.0 / 32}), 1000, {1, -2, 0.5});
        simulation.add(sample_box<3>({0.3, 0.4, 0.2}, {0.5, 0.6, 0.6}, {.spacing = 1.0 / 40}), 1000, {-2, -3, 0});
        simulation.warn = {};
        for (int step = 0; step < test_support::fewer_if_quick(60, 16); ++step) simulation.step();
        std::uint64_t hash = 0;  // of all bits of all particles, in no order
        const auto& particles = simulation.particles();
        std::vector<std::byte> record(particles.record_bytes());
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            particles.write_record(slot, record.data());
            std::uint64_t of_one = 14695981039346656037ull;
            for (const std::byte byte : record) of_one = (of_one ^ std::uint64_t(byte)) * 1099511628211ull;
            hash += of_one ^ of_one >> 29;
        }
        return hash;
    };
    const auto one = run(1);
    CHECK(run(3) == one);
}

}  // namespace shifting_tests
