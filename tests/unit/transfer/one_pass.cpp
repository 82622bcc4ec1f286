// quick: no
// sanitized: no
/// \file Further passes that share a pass over the particles give the nodes the bits of separate passes, for dense
/// matter and for spray.
#include "support/catch.hpp"
#include "support/scenes.hpp"
#include <firn/loops/p2g_with_velocities.hpp>
#include <firn/transfer/aflip.hpp>
#include <firn/transfer/flip.hpp>
#include <firn/transfer/fmpm.hpp>

using namespace firn;

namespace one_pass_tests {

using K = QuadraticBSpline;

/// Two dense blocks in motion, and a cloud of lone particles.
template <class S, int D>
struct Matter {
    Domain<D> domain;
    Particles<S, D, ElasticState<S, D>> particles;
    BlockPartition<D> partition;
    SparseGrid<S, D> grid;

    Matter() : domain(domain_of()), particles(made(domain)), partition(sort_particles<K>(particles, 2)), grid(domain) {
        grid.activate(partition);
        update_stress(Coloured{2}, particles.view(), partition, FixedCorotated<S>{}, domain.cell_size);
        const auto& groups = partition.groups;
        REQUIRE(std::any_of(groups.begin(), groups.end(), is_spray<D>));
        REQUIRE(!std::all_of(groups.begin(), groups.end(), is_spray<D>));
    }
    auto set() { return ParticleSet{particles.view(), partition}; }
    std::vector<S> layer(std::size_t k) const {
        const S* first = k == 0 ? grid.nodes(0) : grid.layer(k);
        return {first, first + grid.block_count() * std::size_t(block_nodes<D> * node_width)};
    }

private:
    static Domain<D> domain_of() {
        Domain<D> made;
        made.cell_size = 1.0 / 32;
        return made;
    }
    static auto made(const Domain<D>& domain) {
        Simulation<D, FixedCorotated<S>> simulation(domain, FixedCorotated<S>{});
        scenes::add_two_blocks<D>(simulation, 0.3, domain.cell_size / 2);
        simulation.warn = [](const std::string&) {};
        simulation.add(sample_box<D>(Vec<double, D>::filled(0.1), Vec<double, D>::filled(0.9),
                                     {.spacing = 3.7 * domain.cell_size, .pattern = Pattern::jittered, .jitter = 0.2}),
                       500, Vec<double, D>::filled(0.3));
        for (int i = 0; i < 5; ++i) simulation.step();  // strains it
        return simulation.particles();
    }
};

template <class S_, int D_, class Transfer_, class Force_>
struct Case {
    using S = S_;
    static constexpr int D = D_;
    using Transfer = Transfer_;
    using Force = Force_;
};

TEMPLATE_TEST_CASE("P2G with and without forces in one pass has the bits of two passes", "[transfer]",
                   (Case<float, 3, Flip<>, MlsForce>), (Case<float, 3, Aflip<>, WeightGradientForce>),
                   (Case<double, 2, Flip<double>, WeightGradientForce>), (Case<float, 2, Asflip<>, MlsForce>)) {
    using S = typename TestType::S;
    using Transfer = typename TestType::Transfer;
    using Force = typename TestType::Force;
    Matter<S, TestType::D> matter;
    const double dt = 1e-3;
    before_p2g<K, Transfer>(Coloured{2}, matter.grid, matter.set());
    p2g<K, Transfer, Force>(Coloured{2}, matter.grid, dt, matter.set());
    const auto momenta = matter.layer(0), velocities = matter.layer(1);
    REQUIRE(momenta != velocities);
    p2g_with_velocities<K, Transfer, Force>(Coloured{2}, matter.grid, Mirrors{}, dt, matter.set());
    CHECK(matter.layer(0) == momenta);
    CHECK(matter.layer(1) == velocities);
}

TEMPLATE_TEST_CASE("Velocities go to the particles and back at once with the bits of two passes", "[transfer]",
                   (Case<float, 3, Fmpm, MlsForce>), (Case<double, 2, Fmpm, MlsForce>)) {
    using S = typename TestType::S;
    Matter<S, TestType::D> matter;
    p2g<K, Fmpm, MlsForce>(Coloured{2}, matter.grid, 1e-3, matter.set());
    detail::velocities_of_momenta(2, matter.grid, Mirrors{});
    matter.grid.exchange(layer::last_of_series);
    auto set = detail::motion_of_set(matter.set());
    aligned_vector<S> memory;
    set.view.velocity = detail::vectors_like(set.view, memory, set.partition.slots(), 2);
    const ParticleSets<decltype(set.view)> all(&set, 1);
    detail::there_and_back<K, Fmpm>(Coloured{2}, matter.grid, 2, all);
    const auto expected = matter.layer(0);
    REQUIRE(expected != matter.layer(layer::last_of_series));
    detail::there_and_back_by_groups<K, Fmpm>(matter.grid, 2, all);
    CHECK(matter.layer(0) == expected);
}

}  // namespace one_pass_tests
