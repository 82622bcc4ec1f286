// sanitized: no
/// \file FBar: the volume change of a particle is the average of those around it, in every combination of policies.
#include "support/by_definition.hpp"
#include "support/catch.hpp"
#include "support/effort.hpp"

using namespace firn;
using by_definition::Case;
using scenes::Kind;

namespace f_bar_tests {
namespace {

template <class C>
using Cloud = scenes::RandomCloud<typename C::S, C::D>;

/// Half of the particles of a cloud, as a set of its own: those with an even or an odd index.
template <class C>
Cloud<C> half_of(const Cloud<C>& cloud, std::size_t half) {
    Cloud<C> part(0);
    const auto take = [&](auto& to, const auto& from, std::size_t count) {
        for (std::size_t p = half; p < cloud.size(); p += 2)
            to.insert(to.end(), from.begin() + std::ptrdiff_t(p * count),
                      from.begin() + std::ptrdiff_t((p + 1) * count));
    };
    constexpr std::size_t D = std::size_t(C::D);
    take(part.x, cloud.x, D);
    take(part.v, cloud.v, D);
    take(part.C, cloud.C, D * D);
    take(part.F, cloud.F, D * D);
    take(part.stress, cloud.stress, D * D);
    take(part.mass, cloud.mass, 1);
    take(part.volume, cloud.volume, 1);
    for (auto& F : part.F) F = typename C::S(0);
    for (std::size_t p = 0; p < part.size(); ++p)
        for (std::size_t a = 0; a < D; ++a) part.F[p * D * D + a * (D + 1)] = typename C::S(1);
    return part;
}

/// The rates of volume change of particles whose F was I a step ago.
template <class C>
std::vector<double> rates_of(const Cloud<C>& cloud, double dt) {
    std::vector<double> rates;
    for (std::size_t p = 0; p < cloud.size(); ++p)
        rates.push_back((trace(by_definition::matrix<C::D>(cloud.F, p)) - C::D) / dt);
    return rates;
}

}  // namespace

TEMPLATE_TEST_CASE("FBar averages the rates of volume change set by set, weighted with volumes, by definition", "",
                   FIRN_TEST_FIRST_1((Case<float, 3, Apic, MlsForce>),
                                     (Case<double, 2, Flip<double>, WeightGradientForce, CubicBSpline>),
                                     (Case<double, 2, Pic, WeightGradientForce, Linear>))) {
    using C = TestType;
    using S = typename C::S;
    using Kernel = typename C::Kernel;
    using Transfer = typename C::Transfer;
    using Force = typename C::Force;
    constexpr int D = C::D;
    const Kind kind = GENERATE(Kind::dense, Kind::spray);
    const Cloud<C> whole(2 * scenes::particles_of<D>(kind));
    const double dt = 1e-3;  // [s]; F of I + dt ∇v keeps enough digits of ∇v
    const FixedCorotated<S> material;

    // The same step twice: every particle with its own volume change, and with the average.
    const auto step = [&]<class Volume>(std::array<Cloud<C>, 2>& sets, Volume) {
        BlockPartition<D> partitions[2];
        for (std::size_t k = 0; k < 2; ++k)
            partitions[k] = partition_particles<Kernel>(sets[k].view(), sets[k].size(), sets[k].domain, 1);
        SparseGrid<S, D> grid(whole.domain);
        BlockPartition<D>* const all[] = {&partitions[0], &partitions[1]};
        grid.activate(all);
        const auto views = std::array{sets[0].view(), sets[1].view()};
        using Set = ParticleSet<std::remove_cvref_t<decltype(views[0])>>;
        const Set a{views[0], partitions[0]}, b{views[1], partitions[1]};
        TransferMemory<S> memory;
        VolumeMemory<S> rates;
        const Coloured execution{2};
        before_p2g<Kernel, Transfer>(execution, grid, a, b);
        p2g<Kernel, Transfer, Force>(execution, grid, dt, a, b);
        after_p2g<Kernel>(execution, grid, Transfer{}, memory, a, b);
        grid_update(execution, grid, dt, Vec<S, D>::zero(), NoBoundary{});
        const std::vector<S> before(grid.nodes(0), grid.nodes(0) + grid.block_count() * block_nodes<D> * node_width);
        for (std::size_t k = 0; k < 2; ++k) {
            if constexpr (Volume::averages_volume)
                average_volume<Kernel, Transfer, Force>(execution, grid, rates, Mirrors{}, k, a, b);
            g2p<Kernel, Transfer, Force, Volume>(execution, views[k], partitions[k], grid, material, dt, Transfer{});
            if constexpr (Volume::averages_volume) restore_masses<Transfer>(execution, grid);
        }
        CHECK(std::equal(before.begin(), before.end(), grid.nodes(0)));
    };
    const std::array<Cloud<C>, 2> start{half_of<C>(whole, 0), half_of<C>(whole, 1)};
    std::array<Cloud<C>, 2> own = start, averaged = start;
    step(own, OwnVolume{});
    step(averaged, FBar{});

    const double rounding = 64 * double(std::numeric_limits<S>::epsilon());
    for (std::size_t k = 0; k < 2; ++k) {
        const std::vector<double> rates = rates_of<C>(own[k], dt);
        std::map<std::array<int, std::size_t(D)>, std::array<double, 2>> sums;
        const auto at = [&](std::size_t p) { return by_definition::vector<D>(start[k].x, p); };
        for (std::size_t p = 0; p < rates.size(); ++p)
            by_definition::for_nodes<Kernel>(whole.domain, at(p), [&](const auto& node) {
                const double volume = node.weight * double(start[k].volume[p]);
                sums[node.index][0] += volume * rates[p];
                sums[node.index][1] += volume;
            });
        double worst = 0, largest = 0, volume_before = 0, volume_after = 0;
        for (std::size_t p = 0; p < rates.size(); ++p) {
            double average = 0;
            by_definition::for_nodes<Kernel>(whole.domain, at(p), [&](const auto& node) {
                const auto& sum = sums[node.index];
                if (sum[1] > 0) average += node.weight * sum[0] / sum[1];
            });
            const Mat<double, D> expected =
                by_definition::matrix<D>(own[k].F, p) + Mat<double, D>::identity() * (dt * (average - rates[p]) / D);
            const Mat<double, D> got = by_definition::matrix<D>(averaged[k].F, p);
            for (int i = 0; i < D * D; ++i) worst = std::max(worst, std::abs(got.m[i] - expected.m[i]));
            largest = std::max(largest, dt * std::abs(average - rates[p]));
            volume_before += double(start[k].volume[p]) * rates[p];
            volume_after += double(start[k].volume[p]) * average;
        }
        CHECK(worst < rounding);
        CHECK(largest > 100 * rounding);  // there was something to average
        CHECK(volume_after == Approx(volume_before).epsilon(1e-9));
        CHECK(own[k].x == averaged[k].x);  // the motion of this step is not touched
        CHECK(own[k].v == averaged[k].v);
    }
}

TEMPLATE_TEST_CASE_SIG("A body that expands evenly keeps the volume change of each of its particles", "",
                       ((class S, int D), S, D), (float, 3)) {
    // The velocity is a x: an affine transfer keeps it in every node, also at the edge of the body.
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1.0), 1.0 / 16};
    const auto material = FixedCorotated<S>::from_young_poisson(1e3, 0.49);
    Simulation simulation(domain, material, FBar{}, detail::Serial{});
    simulation.gravity = {};
    simulation.fixed_time_step = 1e-5;
    simulation.add(sample_sphere<D>(Vec<double, D>::filled(0.5), 0.3, {.spacing = 1.0 / 40}), 1000);
    auto& particles = simulation.edit_particles();
    const S rate = 2;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot)) {
            particles.set_velocity(slot, cast<S>((particles.exact_position(slot) - Vec<double, D>::filled(0.5)) * 2.0));
            particles.set_affine(slot, Mat<S, D>::identity() * rate);
        }
    simulation.step();
    const double expected = std::pow(1 + 1e-5 * double(rate), D);
    double worst = 0;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot)
        if (particles.is_particle(slot))
            worst = std::max(worst, std::abs(double(determinant(particles.state(slot).F)) - expected));
    CHECK(worst < 4 * double(std::numeric_limits<S>::epsilon()));
}

TEST_CASE("FBar has the same bits for any number of threads, and sums in integers with any order") {
    const auto run = [](const auto& execution) {
        const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, 1.0 / 12};
        Simulation simulation(domain,
                              Materials(FixedCorotated<float>::from_young_poisson(1e5, 0.45),
                                        Fluid<float>::from_properties({.bulk = 1e5})),
                              execution, FBar{}, Flip<float>{});
        simulation.warn = {};
        simulation.template set<0>().add(sample_box<3>({0.2, 0.2, 0.2}, {0.5, 0.5, 0.5}, {.spacing = 1.0 / 24}), 1000,
                                         {1, 0, 0});
        simulation.template set<1>().add(sample_box<3>({0.5, 0.0, 0.2}, {0.8, 0.5, 0.5}, {.spacing = 1.0 / 24}), 1000,
                                         {-1, 0, 0});
        for (int step = 0; step < 8; ++step) simulation.step();
        return scenes::hash(simulation.template set<0>().particles());
    };
    const auto one = run(Coloured{1});
    CHECK(run(Coloured{2}) == one);
    CHECK(run(Coloured{3}) == one);
    const auto integers = run(FixedPoint<std::int32_t>{1});
    CHECK(run(FixedPoint<std::int32_t>{3}) == integers);
    CHECK(run(ColouredFixedPoint<std::int32_t>{2}) == integers);
    // The scale of momentum does not apply to volume changes: they would overflow with it.
    CHECK_NOTHROW(run(FixedPoint<std::int32_t>{.threads = 1, .momentum_scale = 0x1p24, .mass_scale = 0x1p24}));
}

TEST_CASE("FBar keeps momentum") {
    const Domain<2> domain{{0, 0}, {1, 1}, 1.0 / 24};
    Simulation simulation(domain, NeoHookean<double>::from_young_poisson(1e5, 0.49), FBar{});
    simulation.gravity = {};
    simulation.add(sample_box<2>({0.2, 0.3}, {0.45, 0.6}, {.spacing = 1.0 / 48}), 1000, {2, 0.5});
    simulation.add(sample_box<2>({0.5, 0.3}, {0.75, 0.6}, {.spacing = 1.0 / 48}), 1000, {-1, 0});
    const auto before = simulation.totals();
    for (int step = 0; step < 100; ++step) simulation.step();
    const auto after = simulation.totals();
    const double scale = before.mass;  // times 1 m/s
    CHECK(std::abs(after.momentum[0] - before.momentum[0]) < 1e-13 * scale);
    CHECK(std::abs(after.momentum[1] - before.momentum[1]) < 1e-13 * scale);
    CHECK(after.kinetic_energy < 0.9 * before.kinetic_energy);  // they have collided
}

TEST_CASE("A simulation takes a volumetric policy in any order, and the default costs no name") {
    const Domain<2> domain{{0, 0}, {1, 1}, 1.0 / 16};
    const FixedCorotated<float> jelly;
    Simulation simulation(domain, jelly, FBar{}, Flip<float>{}, Coloured{2});
    static_assert(std::same_as<decltype(simulation), SimulationWith<2, FixedCorotated<float>, Flip<float>, FBar>>);
    static_assert(std::same_as<Simulation<2>, SimulationWith<2, FixedCorotated<float>, OwnVolume>>);
    CHECK(simulation.execution.threads == 2);
}

}  // namespace f_bar_tests
