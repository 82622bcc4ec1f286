/// \file Totals: sums over particles, the same bits in any order of the particles, and in any shares of ranks.
#include "support/by_definition.hpp"
#include "support/catch.hpp"
#include "support/scenes.hpp"

#include <bit>

using namespace firn;

namespace two_ranks {

/// An execution of two ranks in one program: what the first rank has summed waits for the second.
struct Ranks : Coloured {
    mutable std::vector<std::int64_t>* of_first = nullptr;
    int rank = 0;
};
struct Told : OneRank {
    const Ranks& of;

    void merge(std::span<ExactSum> sums) const {
        for (ExactSum& sum : sums) sum.normalise();
        const auto digits = digits_of(sums);
        if (of.rank == 0)
            of.of_first->assign(digits.begin(), digits.end());
        else
            for (std::size_t k = 0; k < digits.size(); ++k) digits[k] += (*of.of_first)[k];
    }
};
inline Told ranks_of(const Ranks& ranks) { return {{}, ranks}; }

}  // namespace two_ranks

namespace totals_tests {

using two_ranks::Ranks;

/// All numbers of totals, bit by bit.
template <int D>
std::vector<std::uint64_t> bits(const Totals<D>& totals) {
    std::vector<std::uint64_t> all{totals.particles};
    const auto add = [&](const auto& vector) {
        for (int a = 0; a < D; ++a) all.push_back(std::bit_cast<std::uint64_t>(vector[a]));
    };
    add(totals.momentum);
    add(totals.first_moment);
    for (const double x :
         {totals.mass, totals.kinetic_energy, totals.elastic_energy, totals.dissipated_energy, totals.momentum[0]})
        all.push_back(std::bit_cast<std::uint64_t>(x));
    if constexpr (D == 2)
        all.push_back(std::bit_cast<std::uint64_t>(totals.angular_momentum));
    else
        add(totals.angular_momentum);
    return all;
}

/// Particles of a random cloud, whose masses and velocities have many orders of magnitude.
template <class S, int D>
struct Cloud {
    using State = material_state_t<Dissipating<VonMises<S>>, D>;
    scenes::RandomCloud<S, D> of;
    Dissipating<VonMises<S>> material;

    explicit Cloud(std::size_t count) : of(count) {
        for (std::size_t p = 0; p < count; ++p) {
            of.mass[p] *= S(std::pow(10, 8 * scenes::noise(3 * p)));
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                of.v[p * D + a] *= S(std::pow(10, 6 * scenes::noise(3 * p + 1)));
        }
    }
    /// The particles p for which wanted(p) is true.
    template <class Wanted>
    Particles<S, D, State> particles(const Wanted& wanted) const {
        Particles<S, D, State> some(of.domain);
        for (std::size_t p = 0; p < of.mass.size(); ++p) {
            if (!wanted(p)) continue;
            Vec<double, D> x{};
            Vec<S, D> v{};
            Mat<S, D> C{};
            State state{};
            for (std::size_t a = 0; a < std::size_t(D); ++a) {
                x[int(a)] = double(of.x[p * D + a]);
                v[int(a)] = of.v[p * D + a];
            }
            for (std::size_t k = 0; k < std::size_t(D * D); ++k) {
                C.m[k] = of.C[p * D * D + k];
                state.F.m[k] = of.F[p * D * D + k];
            }
            state.dissipated = S(scenes::noise(p));
            some.push_back(x, v, of.mass[p], of.volume[p], state);
            some.set_affine(some.size() - 1, C);
        }
        return some;
    }
    Particles<S, D, State> all() const {
        return particles([](std::size_t) { return true; });
    }
    Totals<D> totals(const Particles<S, D, State>& some, int threads = 1) const {
        return firn::totals<QuadraticBSpline>(some, of.domain, material, threads);
    }
};

TEMPLATE_TEST_CASE_SIG(
    "totals have the same bits in any order of the particles, and for any number of threads and ranks", "",
    ((class S, int D), S, D), (float, 3), (double, 2)) {
    const Cloud<S, D> cloud(3000);
    auto particles = cloud.all();
    const Totals<D> totals = cloud.totals(particles);
    CHECK(totals.particles == 3000);
    CHECK(totals.kinetic_energy > 0);
    CHECK(totals.elastic_energy > 0);
    CHECK(totals.dissipated_energy > 0);
    CHECK(norm(totals.momentum) > 0);

    for (const std::uint64_t seed : {1, 2, 3}) {
        scenes::shuffle(particles, seed);
        for (const int threads : {1, 2, 3, 8}) REQUIRE(bits(cloud.totals(particles, threads)) == bits(totals));
    }
    const Domain<D>& domain = cloud.of.domain;
    for (const std::size_t one_in : {2, 3, 1000}) {
        std::vector<std::int64_t> digits;
        const auto is_of_second = [&](std::size_t p) { return p % one_in == 0; };
        const auto first = cloud.particles([&](std::size_t p) { return !is_of_second(p); });
        const auto second = cloud.particles(is_of_second);
        const auto of_rank = [&](int rank, const auto& share) {
            return detail::totals_of_ranks<QuadraticBSpline>(Ranks{{1}, &digits, rank}, share, domain, cloud.material);
        };
        const Totals<D> of_one = of_rank(0, first), of_both = of_rank(1, second);
        REQUIRE(of_one.particles == first.size());
        REQUIRE(bits(of_one) == bits(cloud.totals(first)));
        REQUIRE(bits(of_both) == bits(totals));
    }
}

TEST_CASE("totals are the sums of their definition") {
    const Cloud<double, 3> cloud(700);
    const auto particles = cloud.all();
    const Totals<3> totals = cloud.totals(particles);
    long double mass = 0, momentum = 0, moment = 0, kinetic = 0, elastic = 0, dissipated = 0;
    long double angular = 0;
    const double h = cloud.of.domain.cell_size, inertia = h * h / 4;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const double m = particles.mass(slot);
        const auto x = particles.exact_position(slot), v = particles.velocity(slot);
        const auto C = particles.affine(slot);
        mass += m;
        momentum += m * v[1];
        moment += m * x[2];
        angular += m * (x[0] * v[1] - x[1] * v[0] + inertia * (C(1, 0) - C(0, 1)));
        kinetic += m / 2 * (dot(v, v) + inertia * squared_norm(C));
        elastic += particles.volume(slot) * energy_density(cloud.material, particles.state(slot));
        dissipated += particles.volume(slot) * particles.state(slot).dissipated;
    }
    const auto about = [](long double expected) { return Approx(double(expected)).epsilon(1e-12); };
    CHECK(totals.mass == about(mass));
    CHECK(totals.momentum[1] == about(momentum));
    CHECK(totals.first_moment[2] == about(moment));
    CHECK(totals.angular_momentum[2] == about(angular));
    CHECK(totals.kinetic_energy == about(kinetic));
    CHECK(totals.elastic_energy == about(elastic));
    CHECK(totals.dissipated_energy == about(dissipated));
}

TEST_CASE("a simulation asks its execution for the totals of all ranks") {
    using Two = Simulation<2, FixedCorotated<double>, Apic, MlsForce, QuadraticBSpline, Ranks>;
    std::vector<std::int64_t> digits;
    const auto of_rank = [&](int rank) {
        Two simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 16}, {}, Ranks{{1}, &digits, rank});
        simulation.warn = {};
        simulation.add(sample_box<2>({0.2, 0.2}, {0.5, 0.5}, {.spacing = 1.0 / 32}), 1000 + rank, {1.0, 2.0});
        return simulation.totals();
    };
    const Totals<2> one = of_rank(0), both = of_rank(1);
    CHECK(both.particles == 2 * one.particles);
    CHECK(both.mass == Approx(2.001 * one.mass).epsilon(1e-12));
    CHECK(both.momentum[1] == Approx(2 * both.mass).epsilon(1e-12));
}

TEST_CASE("totals of an affine field take the inertia of the compact quartic kernel where the particle is") {
    const Cloud<double, 2> cloud(60);
    for (std::size_t p = 0; p < 60; ++p) {
        const auto one = cloud.particles([&](std::size_t q) { return p == q; });
        std::size_t slot = 0;
        while (!one.is_particle(slot)) ++slot;
        const Vec<double, 2> x = one.exact_position(slot), v = one.velocity(slot);
        const Mat<double, 2> C = one.affine(slot);
        Vec<double, 2> D{0.0, 0.0};  // Σ M (x_i − x)², axis by axis
        by_definition::for_nodes<CompactQuartic>(cloud.of.domain, x, [&](const auto& node) {
            for (int a = 0; a < 2; ++a) D[a] += node.weight * node.offset[a] * node.offset[a];
        });
        double energy = dot(v, v);
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) energy += C(i, j) * C(i, j) * D[j];
        const double m = cloud.of.mass[p], turning = x[0] * v[1] - x[1] * v[0] + C(1, 0) * D[0] - C(0, 1) * D[1];
        const auto totals = firn::totals<CompactQuartic>(one, cloud.of.domain, cloud.material, 1);
        CHECK(totals.kinetic_energy == Approx(0.5 * m * energy).epsilon(1e-12));
        CHECK(std::abs(totals.angular_momentum - m * turning) <= 1e-12 * m * (norm(x) * norm(v) + std::abs(turning)));
    }
}

}  // namespace totals_tests
