/// \file The warning of matter that is stretched farther than its kernel joins particles: when it comes, when it does
/// not, and what it says.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/firn.hpp>

using namespace firn;
using test_support::holds;

namespace fracture_tests {

namespace {

constexpr double h = 1.0 / 32;

/// A block of 3 × 2 cells (× 2) before stretching, whose particles lie as if it had been stretched along x.
/// \param n        particles a cell and axis
/// \param stretch  how many times the distances along x, and across, are those at first
/// \param angle    how far the block is turned [rad]
template <int D>
Samples<D> stretched_block(int n, double stretch, double across = 1, double angle = 0) {
    const double s = h / n;
    const Vec<double, D> middle = Vec<double, D>::filled(0.5);
    Samples<D> block{{}, std::pow(s, D)};
    for (int i = 0; i < 3 * n; ++i)
        for (int j = 0; j < 2 * n; ++j)
            for (int k = 0; k < (D == 3 ? 2 * n : 1); ++k) {
                const double x = (i - 1.5 * n) * s * stretch, y = (j - n) * s * across;
                Vec<double, D> at = middle;
                at[0] += std::cos(angle) * x - std::sin(angle) * y;
                at[1] += std::sin(angle) * x + std::cos(angle) * y;
                if (D == 3) at[D - 1] += (k - n) * s * across;
                block.positions.push_back(at);
            }
    return block;
}
/// The deformation gradient of this block.
template <int D>
Mat<double, D> gradient(double stretch, double across = 1, double angle = 0) {
    Mat<double, D> F = Mat<double, D>::identity(), R = Mat<double, D>::identity();
    for (int a = 0; a < D; ++a) F(a, a) = a == 0 ? stretch : across;
    R(0, 0) = R(1, 1) = std::cos(angle);
    R(1, 0) = std::sin(angle);
    R(0, 1) = -R(1, 0);
    return R * F * transpose(R);
}

/// Takes 40 tiny steps with a block whose states are set, and returns what is said.
template <class Simulation, int D, class Set>
std::vector<std::string> said_of(Simulation& simulation, const Samples<D>& block, const Set& set) {
    std::vector<std::string> said;
    simulation.warn = [&](const std::string& text) { said.push_back(text); };
    simulation.gravity = {};
    simulation.fixed_time_step = 1e-7;
    const Body body = simulation.add(block, 1000);
    simulation.set_states(body, [&](const auto&, auto& state) { set(state); });
    for (int i = 0; i < 40; ++i) simulation.step();
    return said;
}
template <class Kernel, int D, class Material>
std::vector<std::string> said_of_elastic(const Material& material, int n, double stretch, double angle = 0) {
    Simulation<D, Material, Apic, WeightGradientForce, Kernel> simulation(
        {Vec<double, D>::zero(), Vec<double, D>::filled(1), h}, material);
    return said_of(simulation, stretched_block<D>(n, stretch, 1, angle),
                   [&](auto& state) { state.F = cast<material_scalar_t<Material>>(gradient<D>(stretch, 1, angle)); });
}
template <class Kernel, int D = 2>
void check_limit(int n, double right, double wrong) {
    CAPTURE(Kernel::name, D, n);
    const auto jelly = NeoHookean<float>::from_young_poisson(1e5, 0.3);
    CHECK(said_of_elastic<Kernel, D>(jelly, n, right).empty());
    const auto said = said_of_elastic<Kernel, D>(jelly, n, wrong);
    REQUIRE(said.size() == 1);  // in 40 steps it is looked for twice
    CHECK(holds(said[0], "matter under tension is stretched " + sentence(float(wrong)).substr(0, 4)));
    CHECK(holds(said[0], "at particle "));
    CHECK(holds(said[0], sentence("particles that lay ", 1.0 / n).substr(0, 22)));
    CHECK(holds(said[0], "more particles a cell"));
}

}  // namespace

TEST_CASE("elastic matter that is stretched farther than its kernel joins particles is warned of, once") {
    check_limit<QuadraticBSpline>(1, 1.04, 1.1);
    check_limit<QuadraticBSpline>(2, 1.62, 1.7);  // bars break at 1.7
    check_limit<QuadraticBSpline>(3, 2.2, 2.35);  // at 2.1 (weight gradients) to 2.5 (MLS)
    check_limit<QuadraticBSpline>(4, 2.8, 3.0);
    check_limit<QuadraticBSpline, 3>(2, 1.62, 1.7);
    check_limit<CubicBSpline>(2, 1.68, 1.75);
    check_limit<CompactQuartic>(2, 1.62, 1.7);
    check_limit<Linear>(2, 1.08, 1.13);
}

TEST_CASE("turned matter, and matter across the ends of a periodic domain, is stretched as well") {
    const auto jelly = FixedCorotated<double>::from_young_poisson(1e5, 0.3);
    for (const double angle : {0.5, 0.785, 2.0}) {
        CAPTURE(angle);
        CHECK(said_of_elastic<QuadraticBSpline, 2>(jelly, 2, 1.6, angle).empty());
        CHECK(said_of_elastic<QuadraticBSpline, 2>(jelly, 2, 1.75, angle).size() == 1);
    }
    // A ring of two particles a cell at first, 32/36 cells apart now: the last ones are joined across the domain's end.
    Simulation<2> simulation({{0, 0}, {1, 1}, h, {true, false}});
    Samples<2> ring{{}, h * h / 4};
    for (int i = 0; i < 36; ++i)
        for (int j = 0; j < 4; ++j) ring.positions.push_back({(i + 0.5) / 36, 0.5 + j * h / 2});
    CHECK(said_of(simulation, ring, [](auto& state) { state.F(0, 0) = 64.0F / 36; }).size() == 1);
}

TEST_CASE("a deformation gradient alone, or matter that is squeezed sideways, is no fracture") {
    const auto jelly = NeoHookean<float>::from_young_poisson(1e5, 0.3);
    Simulation<2, NeoHookean<float>> set_by_hand({{0, 0}, {1, 1}, h}, jelly), squeezed({{0, 0}, {1, 1}, h}, jelly);
    CHECK(said_of(set_by_hand, stretched_block<2>(2, 1), [](auto& state) { state.F(0, 0) = 1.8F; }).empty());
    // Pressed along y to a third, it has given way along x: no tension is left there.
    CHECK(said_of(squeezed, stretched_block<2>(2, 1.75, 0.3), [](auto& state) {
              state.F = cast<float>(gradient<2>(1.75, 0.3));
          }).empty());
}

TEST_CASE("metal that has flowed is warned of where its particles are apart, and not where it was kneaded") {
    using Metal = VonMises<float>;
    const Metal metal = Metal::from_properties({.young = 1e6, .poisson = 0.3, .yield_stress = 1e4});
    const auto said = [&](double stretch, double plastic, double pull) {
        Simulation<3, Metal> simulation({{0, 0, 0}, {1, 1, 1}, h}, metal);
        return said_of(simulation, stretched_block<3>(2, stretch, 1 / std::sqrt(stretch)), [&](auto& state) {
            state.F = cast<float>(gradient<3>(1 + pull, 1 - 0.3 * pull));
            state.plastic_strain = float(plastic);
        });
    };
    CHECK(said(1.6, std::log(1.6), 0.005).empty());
    const auto apart = said(1.8, std::log(1.8), 0.005);
    REQUIRE(apart.size() == 1);
    CHECK(holds(apart[0], "matter under tension is stretched 1.8"));
    CHECK(said(1.0, 5, 0.005).empty());               // kneaded, its particles lie as at first
    CHECK(said(1.8, std::log(1.8), -0.005).empty());  // apart, but not pulled
    CHECK(said(1.8, 0, 0.005).empty());               // it has not flowed: so it was made like that
    // Wrapped, it is the same metal.
    Dissipating<Metal> counted;
    static_cast<Metal&>(counted) = metal;
    Simulation<3, Dissipating<Metal>> simulation({{0, 0, 0}, {1, 1, 1}, h}, counted);
    CHECK(said_of(simulation, stretched_block<3>(2, 1.8, 0.745), [](auto& state) {
              state.F = cast<float>(gradient<3>(1.005, 0.9985));
              state.plastic_strain = 0.6F;
          }).size() == 1);
}

TEST_CASE("the bound of the stretch of metal holds for every plastic strain that keeps the volume") {
    const VonMises<double> metal;
    for (int i = 0; i < 20; ++i) {
        const double e = 0.1 * i;
        VonMises<double>::state<3> state;
        // Uniaxial: strains e, −e/2, −e/2 have α = √⅔ ‖ε‖ = e.
        state.plastic_strain = std::sqrt(2. / 3) * std::sqrt(1.5) * e;
        CHECK(metal.stretch_bound(state) >= std::exp(e) * (1 - 1e-12));
        CHECK(metal.stretch_bound(state) == Approx(std::exp(e)));
    }
}

TEST_CASE("matter that tears by its own law, or bears no tension, is not warned of") {
    STATIC_REQUIRE(detail::tells_stretch<FixedCorotated<float>, 3>);
    STATIC_REQUIRE(detail::tells_stretch<Hencky<float>, 3>);
    STATIC_REQUIRE(detail::tells_stretch<PerParticle<NeoHookean<float>, "mu">, 2>);
    STATIC_REQUIRE(detail::tells_stretch<VonMises<double>, 2>);
    STATIC_REQUIRE(detail::tells_stretch<PerParticle<VonMises<float>, "mu">, 2>);
    STATIC_REQUIRE(!detail::tells_stretch<Sand<float>, 3>);
    STATIC_REQUIRE(!detail::tells_stretch<Snow<float>, 3>);
    STATIC_REQUIRE(!detail::tells_stretch<Nacc<float>, 3>);
    STATIC_REQUIRE(!detail::tells_stretch<Fluid<float>, 3>);
    STATIC_REQUIRE(!detail::tells_stretch<NoStress<float>, 3>);
    STATIC_REQUIRE(!detail::tells_stretch<Dissipating<Snow<float>>, 3>);
}

TEST_CASE("the most stretched particles are the same in whatever order they are found") {
    detail::MostStretched forwards, backwards;
    for (std::uint32_t i = 0; i < 1000; ++i) {
        const auto one = [](std::uint32_t k) { return detail::Stretched{1 + (k * 7919 % 101) / 100.0, k, k}; };
        forwards.add(one(i));
        backwards.add(one(999 - i));
    }
    REQUIRE(forwards.all.size() == detail::MostStretched::most);
    for (std::size_t i = 0; i < forwards.all.size(); ++i) CHECK(forwards.all[i].id == backwards.all[i].id);
    CHECK(forwards.all[0].ratio == 2);
}

}  // namespace fracture_tests
