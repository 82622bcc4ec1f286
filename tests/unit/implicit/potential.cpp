// quick: no
// sanitized: -O1
/// \file The incremental potential: threads, several sets, arrays of another program, floats, and what it refuses.
#include "support/implicit.hpp"

namespace implicit_potential_tests {
using namespace firn;
using namespace implicit_steps;

template <class Block>
std::uint64_t hash_of_nodes(const Block& block) {
    scenes::Hash hash;
    for (std::size_t b = 0; b < block.grid.block_count(); ++b)
        for (int i = 0; i < block_nodes<Block::D>; ++i) hash.add(block.grid.nodes(b) + i * node_width, node_width);
    return hash.value;
}

TEMPLATE_TEST_CASE_SIG("The potential has the same bits for any number of threads", "[implicit]",
                       ((class S, int D, class Force), S, D, Force), (double, 2, WeightGradientForce),
                       (float, 3, MlsForce)) {
    // Dense blocks, cubes of sparse ones, and spray.
    Block<QuadraticBSpline, Force, Hencky<S>, D> block(Hencky<S>::from_young_poisson(1e5, 0.3), 0.05, D == 2 ? 45 : 17,
                                                       7.7);
    CHECK(scenes::has(block.partition, scenes::Kind::dense));
    CHECK(std::any_of(block.partition.groups.begin(), block.partition.groups.end(), [](auto& g) { return g.sparse; }));
    block.put(block.random_displacement(0.05, 5), block.of_u);
    block.put(block.random_displacement(1, 6), block.of_v);
    std::array<std::uint64_t, 2> expected{};
    double energy = 0;
    for (const int threads : {1, 2, 3}) {
        auto potential = block.potential(threads);
        const auto report = potential.displace(block.of_u);
        REQUIRE(report.is_regular());
        potential.gradient();
        const std::uint64_t gradient = hash_of_nodes(block);
        potential.product(block.of_v);
        const std::array<std::uint64_t, 2> hashes{gradient, hash_of_nodes(block)};
        if (threads == 1) expected = hashes, energy = report.energy;
        CHECK(hashes == expected);
        CHECK(report.energy == energy);
    }
    CHECK(energy > 0);
}

TEST_CASE("Floats give what doubles give, rounded", "[implicit]") {
    Block<QuadraticBSpline, MlsForce, NeoHookean<float>, 3> floats({}, 0.05);
    Block<QuadraticBSpline, MlsForce, NeoHookean<double>, 3> doubles({}, 0.05);
    const auto run = [](auto& block) {
        block.put(block.random_displacement(0.05, 5), block.of_u);
        block.put(block.random_displacement(1, 6), block.of_v);
        auto potential = block.potential();
        const double energy = potential.displace(block.of_u).energy;
        potential.gradient();
        const Numbers gradient = block.get();
        potential.product(block.of_v);
        return std::tuple{energy, gradient, block.get()};
    };
    const auto [energy, gradient, product] = run(floats);
    const auto [exact_energy, exact_gradient, exact_product] = run(doubles);
    CHECK(energy == Approx(exact_energy).epsilon(1e-5));
    CHECK((gradient - exact_gradient).norm() < 1e-5 * exact_gradient.norm());
    CHECK((product - exact_product).norm() < 1e-5 * exact_product.norm());
}

TEST_CASE("An inverted particle is reported, and no number is NaN", "[implicit]") {
    const auto value = GENERATE(-3.0, std::numeric_limits<double>::quiet_NaN());
    Block<QuadraticBSpline, WeightGradientForce, Hencky<double>, 2> block({}, 0.05, 12);
    Numbers u = Numbers::Zero(block.size());
    auto potential = block.potential();
    block.put(u, block.of_u);
    CHECK(potential.displace(block.of_u).is_regular());
    // The middle node moves three cells, so the particles on one side of it are turned inside out.
    u[2 * block.of[70].weights[4].first] = value * block.domain.cell_size;
    block.put(u, block.of_u);
    const auto report = potential.displace(block.of_u);
    std::size_t count = 0, first = std::numeric_limits<std::size_t>::max();
    for (const auto& p : block.of)
        if (!(determinant(Mat<double, 2>::identity() + block.gradient_at(p, u)) > 0))
            ++count, first = std::min(first, p.slot);
    CHECK(count > 0);
    CHECK(count < block.of.size());
    CHECK(report.inverted == count);
    CHECK(report.first == first);
    CHECK(report.set == 0);
    CHECK(!report.is_regular());
    CHECK(std::isfinite(report.energy));
    potential.gradient();
    CHECK(block.get().allFinite());
    block.put(block.random_displacement(1, 6), block.of_v);
    potential.product(block.of_v);
    CHECK(block.get().allFinite());
}

TEST_CASE("The sets of a grid add up, also in arrays of another program", "[implicit]") {
    using Kernel = QuadraticBSpline;
    using Force = WeightGradientForce;
    scenes::RandomCloud<double, 2> a(300, 1), b(300, 2);
    for (auto* cloud : {&a, &b})
        for (double& F : cloud->F) F *= 1;
    auto view_a = a.view(), view_b = b.view();
    auto in_a = partition_particles<Kernel>(view_a, a.size(), a.domain, 1);
    auto in_b = partition_particles<Kernel>(view_b, b.size(), b.domain, 1);
    SparseGrid<double, 2> grid(a.domain);
    std::array both{&in_a, &in_b};
    grid.activate(both, 1);
    const std::size_t numbers = grid.block_count() * std::size_t(block_nodes<2> * node_width);
    grid.exchange(1);
    for (std::size_t i = 0; i < numbers; ++i)
        grid.layer(1)[i] = i % node_width < 2 ? 0.002 * (scenes::noise(i) - 0.5) : 0;
    using View = ForeignParticles<double, 2>;
    const NeoHookean<double> soft{};
    const auto stiff = FixedCorotated<double>::from_young_poisson(1e7, 0.2);
    DisplacedSet<Kernel, Force, View, NeoHookean<double>> set_a(ParticleSet{view_a, in_a}, soft);
    DisplacedSet<Kernel, Force, View, FixedCorotated<double>> set_b(ParticleSet{view_b, in_b}, stiff);
    const auto run = [&](auto potential) {
        const auto report = potential.displace(1);
        REQUIRE(report.is_regular());
        potential.gradient();
        std::vector<double> all(grid.nodes(0), grid.nodes(0) + numbers);
        potential.product(1);
        all.insert(all.end(), grid.nodes(0), grid.nodes(0) + numbers);
        all.push_back(report.energy);
        return all;
    };
    const auto of_a = run(IncrementalPotential(grid, 1, 1, set_a)), of_b = run(IncrementalPotential(grid, 1, 1, set_b)),
               of_both = run(IncrementalPotential(grid, 1, 2, set_a, set_b));
    double size = 0;
    for (const double x : of_both) size = std::max(size, std::abs(x));
    for (std::size_t i = 0; i < of_both.size(); ++i) CHECK(std::abs(of_both[i] - of_a[i] - of_b[i]) <= 1e-14 * size);
}

TEST_CASE("What the potential refuses", "[implicit]") {
    Block<QuadraticBSpline, MlsForce, NeoHookean<double>, 2> block({}, 0.05);
    auto potential = block.potential();
    CHECK_THROWS_AS(potential.gradient(), usage_error);
    CHECK_THROWS_AS(potential.product(block.of_v), usage_error);
    CHECK_THROWS_AS(potential.displace(0), usage_error);
    CHECK_THROWS_AS(potential.displace(7), usage_error);
    potential.displace(block.of_u);
    potential.product(block.of_v);
    CHECK_THROWS_AS(potential.gradient(), usage_error);
    for (const double dt : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
        block.dt = dt;
        CHECK_THROWS_AS(block.potential(), parameter_error);
    }
}

}  // namespace implicit_potential_tests
