// sanitized: no
/// \file VolumeFilter: null modes of the volume ratios decay, the volume and linear pressures stay.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/scenes.hpp"
#include <firn/firn.hpp>
#include <firn/soil.hpp>

#include <bit>
#include <cmath>

using namespace firn;

namespace volume_filter_tests {
namespace {

/// A block of a fluid or of a solid between the planes of a box; all particles have the same volume.
template <int D, class Material, class Kernel = QuadraticBSpline>
struct Block {
    using S = material_scalar_t<Material>;
    static constexpr double h = 1.0 / 32;
    Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1.0), h};
    Material material;
    Particles<S, D, material_state_t<Material, D>> particles{domain};
    BlockPartition<D> partition;
    SparseGrid<S, D> grid{domain};

    /// \param change_of  J − 1 of the particle at x
    template <class F>
    explicit Block(const Material& of, const F& change_of) : material(of) {
        auto samples = sample_box<D>(Vec<double, D>::filled(0.25), Vec<double, D>::filled(0.75), {.spacing = h / 2});
        for (const auto& x : samples.positions) {
            auto state = initial_state<D>(material);
            const S change = S(change_of(x));
            if constexpr (has_volume_ratio<material_state_t<Material, D>>)
                state.J = S(1) + change;
            else
                state.F = state.F * std::pow(S(1) + change, S(1) / S(D));
            particles.push_back(x, {}, S(1), S(samples.volume), state);
        }
        partition = sort_particles<Kernel>(particles);
        grid.activate(partition);
        update_stress(detail::Serial{}, particles.view(), partition, material, h);
    }
    void filter(S share, const Mirrors& mirrors = {}) {
        FilterMemory<S> memory;
        const ParticleSet set{particles.view(), partition};
        const auto filter_all = [&](auto all) {
            filter_volumes<Kernel>(Coloured{2}, grid, memory, mirrors, share, material, set, 0, all);
        };
        firn::detail::with_sets(filter_all, set);
    }
    /// f(x, J − 1, slot) for all particles.
    template <class F>
    void each(const F& f) const {
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot))
                f(particles.exact_position(slot), double(volume_change(particles.state(slot))), slot);
    }
};

/// 1 and −1 from particle to particle, along every axis.
double checkerboard(const auto& x) {
    long sum = 0;
    for (int a = 0; a < int(sizeof x / sizeof x[0]); ++a) sum += std::lround(std::floor(x[a] * 64 + 1e-9));
    return sum % 2 == 0 ? 1 : -1;
}
/// More than six cells from all faces of the block: what two averages reach.
template <int D>
bool is_inner(const Vec<double, D>& x) {
    bool inner = true;
    for (int a = 0; a < D; ++a) inner = inner && x[a] > 0.25 + 6.0 / 32 && x[a] < 0.75 - 6.0 / 32;
    return inner;
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("The filter removes a checkerboard of volumes, and keeps a linear pressure and the volume", "",
                       ((class Material, int D), Material, D),
                       FIRN_TEST_FIRST_2((Fluid<double>, 2), (Fluid<float>, 3), (FixedCorotated<double>, 3),
                                         (NeoHookean<float>, 2))) {
    using S = material_scalar_t<Material>;
    Material material;
    if constexpr (requires { material.tension; }) material.tension = S(1e4);  // so that matter with J > 1 takes part
    const auto smooth = [](const auto& x) { return 1e-2 * (x[1] - 0.5) + 2e-3 * (x[0] - 0.5); };
    Block<D, Material> block(material, [&](const auto& x) { return smooth(x) + 1e-3 * checkerboard(x); });
    double before = 0, after = 0, most = 0, largest = 0;
    block.each([&](const auto&, double change, std::size_t slot) {
        before += change;
        largest = std::max(largest, std::abs(double(trace(block.particles.stress(slot)))));
    });
    const double epsilon = double(std::numeric_limits<S>::epsilon()), rounding = 30 * epsilon;

    block.filter(1);
    block.each([&](const auto& x, double change, std::size_t slot) {
        after += change;
        if (is_inner(x)) most = std::max(most, std::abs(change - smooth(x)));
        // The stress is that of the new state: a modulus times J − 1, which is at most 5e-3, and J is rounded.
        const auto stress = kirchhoff_stress(block.material, block.particles.state(slot));
        CHECK(double(trace(block.particles.stress(slot))) ==
              Approx(double(trace(stress))).epsilon(1e-5).margin(2 * epsilon / 5e-3 * largest));
    });
    // Exact: (1 − A)² of a linear field is zero, that of a checkerboard is the checkerboard; see below. What is left
    // are the terms of the order change² of det F, at most (1e-2)² here, and rounding.
    const double quadratic = has_volume_ratio<material_state_t<Material, D>> ? 0 : 4e-6;
    CAPTURE(most, before, after);
    CHECK(most < rounding + quadratic);
    CHECK(std::abs(after - before) < double(block.particles.size()) * (rounding + quadratic));
}

TEST_CASE("A pass of the filter removes the share b (1 − A)² of a wave, by hand") {
    Fluid<double> water;
    water.tension = 1e4;
    const double k = 2 * 3.14159265358979323846 / 8 * 32;  // 8 cells long
    const double share = GENERATE(1.0, 0.25);
    using Waves = Block<2, Fluid<double>>;
    Waves block(water, [&](const auto& x) { return 1e-4 * std::cos(k * (x[1] - 0.5)); });
    // By the definition, along the axis of the wave; across it, weights sum to one.
    const auto averaged = [&](const std::vector<double>& f) {
        std::vector<double> sum(f.size() / 2 + 4), weight(sum.size()), result(f.size());
        for (int pass = 0; pass < 2; ++pass)
            for (std::size_t p = 0; p < f.size(); ++p) {
                const double x = 0.25 + 0.5 * double(p) + 1;
                const auto base = std::size_t(x - 0.5);
                const auto w = QuadraticBSpline::weights(x - double(base));
                for (std::size_t i = 0; i < 3; ++i)
                    if (pass == 0)
                        sum[base + i] += w[i] * f[p], weight[base + i] += w[i];
                    else
                        result[p] += w[i] * sum[base + i] / weight[base + i];
            }
        return result;
    };
    std::vector<double> f(32);  // as the block: 16 cells from its lower to its upper end
    for (std::size_t p = 0; p < f.size(); ++p) f[p] = 1e-4 * std::cos(k * ((0.25 + 0.5 * double(p)) / 32 - 0.25));
    const auto once = averaged(f), twice = averaged(once);
    block.filter(share);
    double worst = 0;
    block.each([&](const auto& x, double change, std::size_t) {
        const std::size_t p = std::size_t((x[1] - 0.25) * 64);
        worst = std::max(worst, std::abs(change - (f[p] - share * (f[p] - 2 * once[p] + twice[p]))));
    });
    CHECK(worst < 1e-15);
    CHECK(std::abs(f[3] - 2 * once[3] + twice[3]) > 1e-8);  // there was something to remove
}

TEST_CASE("The filter leaves out particles without pressure, such as spray") {
    const Fluid<double> water;  // tension 0: no pressure for J > 1
    Block<2, Fluid<double>> block(water, [](const auto& x) { return x[1] > 0.5 ? 0.5 : -1e-3; });
    block.filter(1);
    block.each([](const auto& x, double change, std::size_t) {
        CHECK(change == Approx(x[1] > 0.5 ? 0.5 : -1e-3).epsilon(1e-12));
    });
}

TEST_CASE("The filter has the same bits for any number of threads, and changes a run; its pass comes when it is due") {
    const auto run = [](const auto& execution, VolumeFilter filter = {.every = 2}) {
        const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, 1.0 / 16};
        SimulationWith<3, Materials<Snow<float>, Fluid<float>>, VolumeFilter, Flip<float>,
                       std::remove_cvref_t<decltype(execution)>>
            simulation(domain, Materials(Snow<float>{}, Fluid<float>::from_properties({.bulk = 1e5, .viscosity = 1})),
                       execution, filter, Flip<float>{});
        simulation.warn = {};
        simulation.boundary.nodes_behind = NodesBehind::mirrored;
        simulation.template set<0>().add(sample_box<3>({0.2, 0.2, 0.2}, {0.5, 0.5, 0.5}, {.spacing = 1.0 / 32}), 400,
                                         {1, 0, 0});
        simulation.template set<1>().add(sample_box<3>({0.5, 0.0, 0.2}, {0.8, 0.5, 0.5}, {.spacing = 1.0 / 32}), 1000,
                                         {-1, 0, 0});
        for (int step = 0; step < test_support::fewer_if_quick(12, 6); ++step) simulation.step();
        std::uint64_t hash = scenes::hash(simulation.template set<0>().particles());
        const auto& water = simulation.template set<1>().particles();
        for (const std::uint32_t slot : slots_by_id(water, 1))
            hash = hash * 31 + std::bit_cast<std::uint32_t>(water.state(slot).J);
        return hash;
    };
    const auto one = run(Coloured{1});
    CHECK(run(Coloured{3}) == one);
    CHECK(run(Coloured{1}, {.every = 100}) != one);
    CHECK(run(Coloured{1}, {.every = 100}) == run(Coloured{1}, {.every = 1, .rate = 0, .shifting = 0}));
    const auto integers = run(FixedPoint<std::int32_t>{1});
    CHECK(run(FixedPoint<std::int32_t>{3}) == integers);
    CHECK(run(ColouredFixedPoint<std::int32_t>{2}) == integers);
}

TEST_CASE("The filter returns the model of Undrained and PlasticVolume to its yield surface, and keeps what they add") {
    const auto soil = MohrCoulomb<double>::from_properties({.young = 1e6, .cohesion = 1e3});
    const Undrained<MohrCoulomb<double>> wet{soil, 1e7};
    const PlasticVolume<MohrCoulomb<double>> dilating{soil};
    auto state = initial_state<3>(soil);
    state.F = Mat<double, 3>::rows(0.99, 0.02, 0, 0, 1.01, 0, 0, 0, 1);
    const double change = 0.01;
    const auto expected = with_volume_change<3>(soil, state, change);
    CHECK(expected.plastic_strain > 0);  // it yields
    const auto check = [&](const auto& material, const auto& with_more) {
        const auto after = with_volume_change<3>(material, with_more, change);
        CHECK(after.plastic_strain == expected.plastic_strain);
        for (int i = 0; i < 9; ++i)
            CHECK(Mat<double, 3>(after.F)(i / 3, i % 3) == Mat<double, 3>(expected.F)(i / 3, i % 3));
        return after;
    };
    const Undrained<MohrCoulomb<double>>::state<3> under_pressure{state, 5e3};
    CHECK(check(wet, under_pressure).pore_pressure == 5e3);
    CHECK(PlaneStrain<Undrained<MohrCoulomb<double>>>{wet}.returned(under_pressure).pore_pressure == 5e3);
    CHECK(check(dilating, PlasticVolume<MohrCoulomb<double>>::state<3>{state, 7}).plastic_volume_rate == 7);
}

TEST_CASE("VolumeFilter refuses an interval below 1 and a rate that is no rate") {
    CHECK_THROWS_AS((VolumeFilter{.every = 0}.check()), parameter_error);
    CHECK_THROWS_AS((VolumeFilter{.every = 1, .rate = -1}.check()), parameter_error);
    CHECK_THROWS_AS((VolumeFilter{.every = 1, .rate = std::nan("")}.check()), parameter_error);
    // A rate in time: two passes of one step remove what a pass of two steps removes, to the order of dt².
    const double twice = 1 - std::pow(1 - VolumeFilter{.every = 1}.share(1e-3), 2);
    CHECK(twice == Approx((VolumeFilter{.every = 2}.share(1e-3))).epsilon(2e-3));
    const Domain<2> domain{{0, 0}, {1, 1}, 1.0 / 8};
    const VolumeFilter idle{.every = 0};
    Simulation simulation(domain, Fluid<float>{}, idle);
    simulation.add(sample_box<2>({0.2, 0.2}, {0.5, 0.5}, {.spacing = 1.0 / 16}), 1000);
    CHECK_THROWS_AS(simulation.step(), parameter_error);
}

}  // namespace volume_filter_tests
