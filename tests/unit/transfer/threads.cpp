// sanitized: no
/// \file Transfers with further passes have the same bits for any number of threads, for firn's own particles and with
/// every execution that promises it.
#include "support/catch.hpp"
#include "support/effort.hpp"
#include "support/scenes.hpp"

using namespace firn;

namespace {

template <class S_, int D_, class Transfer_, class Execution_ = Coloured>
struct Case {
    using S = S_;
    static constexpr int D = D_;
    using Transfer = Transfer_;
    using Execution = Execution_;
};

/// Matter in two blocks that collide, in ten steps with sorting between them.
template <class C>
std::vector<double> run(int threads) {
    using S = typename C::S;
    constexpr int D = C::D;
    using K = QuadraticBSpline;
    using Transfer = typename C::Transfer;
    typename C::Execution execution;
    execution.threads = threads;
    Domain<D> domain;
    domain.cell_size = D == 2 ? 1.0 / 32 : 1.0 / 16;
    const double dt = 0.2 * domain.cell_size / 12;
    const auto material = FixedCorotated<S>::from_young_poisson(S(1e5), S(0.3));
    using Matter = Simulation<D, FixedCorotated<S>>;
    Matter simulation(domain, material);
    scenes::add_two_blocks<D>(simulation, 0.3, domain.cell_size / 2);
    auto particles = simulation.particles();
    SparseGrid<S, D> grid(domain);
    TransferMemory<S> memory;
    const Transfer transfer{};
    for (int step = 0; step < 10; ++step) {
        const auto partition = sort_particles<K>(particles, threads);
        grid.activate(partition);
        const auto view = particles.view();
        const ParticleSet set{view, partition};
        if (step == 0) update_stress(execution, view, partition, material, domain.cell_size);
        before_p2g<K, Transfer>(execution, grid, set);
        p2g<K, Transfer, MlsForce>(execution, grid, dt, set);
        after_p2g<K>(execution, grid, transfer, memory, set);
        grid_update(execution, grid, dt, Vec<double, D>::filled(-1), simulation.boundary);
        g2p<K, Transfer, MlsForce>(execution, view, partition, grid, material, dt, transfer);
    }
    std::vector<double> numbers;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const auto x = particles.position(slot), v = particles.velocity(slot);
        const auto C_p = particles.affine(slot), H = displacement_gradient(particles.state(slot).F);
        numbers.push_back(particles.id(slot));
        numbers.insert(numbers.end(), x.v, x.v + D);
        numbers.insert(numbers.end(), v.v, v.v + D);
        numbers.insert(numbers.end(), C_p.m, C_p.m + D * D);
        numbers.insert(numbers.end(), H.m, H.m + D * D);
    }
    return numbers;
}

}  // namespace

TEMPLATE_TEST_CASE("Steps of FLIP, AFLIP, ASFLIP and FMPM have the same bits for 1, 2, 3, 4 and 7 threads",
                   "[transfer]",
                   FIRN_TEST_FIRST_3((Case<float, 3, Flip<>>), (Case<float, 2, Asflip<>>), (Case<double, 2, Fmpm>),
                                     (Case<double, 2, Aflip<double>>), (Case<float, 3, Fmpm>),
                                     (Case<float, 3, Fmpm, FixedPoint<std::int32_t>>))) {
    const auto one = run<TestType>(1);
    REQUIRE(one.size() > 1000);
    for (const double number : one) REQUIRE(std::isfinite(number));
    for (const int threads : test_support::other_threads) CHECK(run<TestType>(threads) == one);
}
