/// \file Models whose parameters were given directly, and are of no use: refused before the first step.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/not_finite.hpp"
#include <firn/firn.hpp>
#include <firn/lagrangian/net_forces.hpp>
#include <firn/soil.hpp>

namespace check_tests {

using namespace firn;
using test_support::holds;
using test_support::infinity;
using test_support::message;
using test_support::not_a_number;

namespace {

/// Sets one parameter after the other to numbers that it must not have.
/// \param wrong  of each parameter, in their order, besides NaN and infinities
template <class Material>
void check_each(const std::vector<std::vector<double>>& wrong) {
    using S = material_scalar_t<Material>;
    CHECK_NOTHROW(check_material<2>(Material{}));
    CHECK_NOTHROW(check_material<3>(Material{}));
    std::size_t parameters = 0;
    const Material as_given;
    for_parameters(as_given, [&](const std::string&, const char*, const auto&) { ++parameters; });
    REQUIRE(parameters == wrong.size());
    for (std::size_t k = 0; k < parameters; ++k) {
        std::vector<double> all = wrong[k];
        all.insert(all.end(), {not_a_number, infinity, -infinity});
        for (const double value : all) {
            Material material;
            std::size_t place = 0;
            std::string changed;
            for_parameters(material, [&](const std::string& name, const char*, auto& parameter) {
                if (place++ != k) return;
                parameter = S(value);
                changed = name;
            });
            CAPTURE(Material::name, changed, value);
            CHECK_THROWS_AS(check_material<2>(material), parameter_error);
            const std::string said = message<parameter_error>([&] { check_material<3>(material); });
            CAPTURE(said);
            CHECK(said.size() > 40);
            if (std::isnan(value)) CHECK(holds(said, changed));
        }
    }
}

/// A user's model: one modulus, and no check() of its own.
template <scalar S>
struct Own {
    S modulus = S(1e5);
    static constexpr const char* name = "own";
    static constexpr auto parameters() { return std::tuple{parameter{"modulus", "Pa", &Own::modulus}}; }
    template <int D>
    Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const {
        return (F + transpose(F) - Mat<S, D>::identity() * S(2)) * modulus;
    }
    template <int D>
    S wave_speed(const S& density, const Mat<S, D>&) const {
        return sqrt(S(2) * modulus / density);
    }
};

}  // namespace

TEST_CASE("parameters that were given directly and are of no use are refused", "[material]") {
    const std::vector<double> shear{-1, 1e39}, plastic_shear{-1, 0}, lambda{-1e9, 1e39};
    check_each<FixedCorotated<float>>({shear, lambda});
    check_each<NeoHookean<float>>({shear, lambda});
    check_each<Hencky<float>>({shear, lambda});
    check_each<VonMises<float>>({plastic_shear, lambda, {0, -1}, {-1}});
    check_each<Snow<float>>({shear, lambda, {0, -1, 1.1}, {0.9, -1}, {-1}, {-1}});
    check_each<Sand<float>>({plastic_shear, lambda, {-0.1, 1.6}, {-1, 1}, {-1}, {}});
    check_each<MohrCoulomb<float>>(
        {plastic_shear, lambda, {-1}, {-0.1, 1.6}, {-0.1, 0.5}, {-1, 1e39}, {-1}, {-0.1, 1.6}, {-0.1, 0.5}, {-1}});
    check_each<SofteningBand<MohrCoulomb<float>>>({plastic_shear,
                                                   lambda,
                                                   {-1},
                                                   {-0.1, 1.6},
                                                   {-0.1, 0.5},
                                                   {-1, 1e39},
                                                   {-1},
                                                   {-0.1, 1.6},
                                                   {-0.1, 0.5},
                                                   {-1},
                                                   {0, -1}});
    check_each<Nacc<float>>({plastic_shear, lambda, {-0.1, 1}, {-1}, {-1, 0}, {0.1}});
    check_each<ModifiedCamClay<float>>(
        {{0, -1}, {0, -1, 0.01, 1}, {0, -1, 0.2}, {-1, 1e6}, {-1, 0}, {0, -1, 6e4}, {0, 9e3}});
    check_each<Fluid<float>>({{0, -1, 1e39}, {0, 0.9, 16}, {-1}, {-1}});
    check_each<Own<float>>({{-1, 1e39}});
    check_each<PerParticle<FixedCorotated<double>, "mu">>({{-1}, {-1e9}});
}

TEST_CASE("a simulation, and the stages by themselves, refuse such a model before anything else", "[material]") {
    using Elastic = FixedCorotated<float>;
    const Domain<2> domain{{0, 0}, {1, 1}, 1.0 / 16};
    const Elastic soft{.mu = -1, .lambda = 0};
    CHECK(holds(message<parameter_error>([&] { Simulation<2>(domain, soft); }), "Lamé parameters μ = -1"));

    std::vector<float> numbers(64, 0.5F);
    const auto span = StridedSpan<float>::scalars(numbers.data(), 16);
    const ForeignParticles<float, 2> view{span, span, span, span, span, span, {span}};
    const auto partition = partition_particles<QuadraticBSpline>(view, 1, domain);
    SparseGrid<float, 2> grid(domain);
    grid.activate(partition);
    CHECK_THROWS_AS(update_stress(detail::Serial{}, view, partition, soft, 0.1), parameter_error);
    const auto step = [&](double dt, const Elastic& material) {
        g2p<QuadraticBSpline, Apic, MlsForce>(detail::Serial{}, view, partition, grid, material, dt);
    };
    CHECK_THROWS_AS(step(1e-3, soft), parameter_error);
    for (const double dt : {-1.0, not_a_number, infinity}) CHECK_THROWS_AS(step(dt, Elastic{}), parameter_error);
    CHECK_THROWS_AS(membranes_of(Net<3>{}, soft, 0.1), parameter_error);
}

}  // namespace check_tests
