// part: arithmetic
// quick: no
/// \file The derivative of every material by dual numbers, of its new state and stress, against difference quotients:
/// where principal stretches are equal, where they nearly are, and where they are far apart.
#include "support/effort.hpp"
#include "support/materials.hpp"
#include <firn/material/dissipating.hpp>
#include <firn/material/fixed_corotated.hpp>
#include <firn/material/fluid.hpp>
#include <firn/material/hencky.hpp>
#include <firn/material/mohr_coulomb.hpp>
#include <firn/material/modified_cam_clay.hpp>
#include <firn/material/nacc.hpp>
#include <firn/material/neo_hookean.hpp>
#include <firn/material/sand.hpp>
#include <firn/material/snow.hpp>
#include <firn/material/von_mises.hpp>
#include <firn/math/traced.hpp>

using namespace materials;

namespace tangent_tests {
namespace {

/// The numbers of the new state and the stress [of a modulus] of matter that had the given F, or the volume ratio det
/// F, and moves with the velocity gradient C for a second.
template <class T, int D, class M>
std::vector<T> after(const M& plain, const Mat<T, D>& F, const Mat<T, D>& C, double modulus) {
    const auto model = lift<T>(plain);
    auto state = initial_state<D>(model);
    if constexpr (requires { state.F; })
        state.F = DeformationGradient<T, D>(F);
    else
        state.J = VolumeRatio<T>::from_excess(determinant(F) - T(1));
    state = updated(model, state, C, T(1));
    std::vector<T> all;
    for (const T& x : stress_of(model, state, C).m) all.push_back(x * T(1 / modulus));
    std::apply(
        [&](const auto&... field) {
            const auto add = [&](const auto& member) {
                for (const T& x : numbers_in(member)) all.push_back(x);
            };
            (add(state.*field.member), ...);
        },
        std::remove_cvref_t<decltype(state)>::fields());
    return all;
}

/// The largest difference of the derivative from the closest of several central differences.
template <int D, class M>
double error_of(const M& model, const Mat<double, D>& F, const Mat<double, D>& dF, const Mat<double, D>& dC,
                double modulus) {
    using Dual = dual<double>;
    Mat<Dual, D> lifted, rate;
    for (int i = 0; i < D * D; ++i) lifted.m[i] = {F.m[i], dF.m[i]}, rate.m[i] = {0, dC.m[i]};
    const std::vector<Dual> got = after<Dual>(model, lifted, rate, modulus);
    double closest = std::numeric_limits<double>::infinity();
    for (const double h : {1e-4, 3e-5, 1e-5, 3e-6, 1e-6}) {
        // Two central differences, extrapolated to an error of h⁴.
        const auto at = [&](double t) { return after<double>(model, F + dF * t, dC * t, modulus); };
        const auto a = at(h), b = at(-h), c = at(2 * h), d = at(-2 * h);
        double error = 0, size = 1;
        for (std::size_t k = 0; k < got.size(); ++k) {
            const double wanted = (8 * (a[k] - b[k]) - (c[k] - d[k])) / (12 * h);
            const double off = std::abs(got[k].derivative - wanted);
            size = std::max(size, std::abs(wanted));
            error = std::isnan(off) ? std::numeric_limits<double>::infinity() : std::max(error, off);
        }
        closest = std::min(closest, error / size);
    }
    return closest;
}

/// The largest difference of ⟨u, J (dF, dC)⟩ by dual numbers from ⟨Jᵀ u, (dF, dC)⟩ by traced ones, relative to the sum
/// of the sizes of all products. \param u  a weight for each result
template <int D, class M>
double error_of_transpose(const M& model, const Mat<double, D>& F, const Mat<double, D>& dF, const Mat<double, D>& dC,
                          double modulus, Random& random) {
    using Dual = dual<double>;
    using Traced = traced<double>;
    Mat<Dual, D> lifted, rate;
    for (int i = 0; i < D * D; ++i) lifted.m[i] = {F.m[i], dF.m[i]}, rate.m[i] = {0, dC.m[i]};
    const std::vector<Dual> forward = after<Dual>(model, lifted, rate, modulus);
    auto& tape = Tape<double>::mine();
    tape.cut(1);
    Mat<Traced, D> of_F, of_C;
    for (int i = 0; i < D * D; ++i) of_F.m[i] = Traced::input(F.m[i]), of_C.m[i] = Traced::input(0);
    const std::vector<Traced> results = after<Traced>(model, of_F, of_C, modulus);
    tape.begin();
    double along = 0, back = 0, size = 0;
    for (std::size_t k = 0; k < results.size(); ++k) {
        if (std::abs(results[k].value - forward[k].value) > 1e-12 * (1 + std::abs(forward[k].value)))
            return std::numeric_limits<double>::infinity();
        const double u = random.uniform(-1, 1);
        if (results[k].node != Tape<double>::no_node) tape.seed(results[k].node, u);
        along += u * forward[k].derivative;
        size += std::abs(u * forward[k].derivative);
    }
    tape.back();
    for (int i = 0; i < D * D; ++i)
        for (const double term : {tape.adjoint(of_F.m[i].node) * dF.m[i], tape.adjoint(of_C.m[i].node) * dC.m[i]})
            back += term, size += std::abs(term);
    return std::abs(along - back) / size;
}

/// \param middle  principal stretches at which the material is not on the edge of flowing, whatever the spacing
template <int D, class M>
void require_tangents(const M& model, double modulus, std::initializer_list<double> middle) {
    Random random(41);
    for (const double m : middle)
        for (const double apart : {0., 1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 0.04})
            for (int k = 0; k < test_support::fewer_if_quick(12, 4); ++k) {
                Vec<double, D> stretches{};
                for (int i = 0; i < D; ++i) stretches[i] = m - (k % 2 && i == 2 ? 0.03 : i) * apart;
                const Mat<double, D> F =
                    k == 0 ? Mat<double, D>::diagonal(m) : with_singular_values<D>(random, stretches);
                const Mat<double, D> dF = random.gaussian<D>(), dC = random.gaussian<D>();
                CAPTURE(name_of<M>(), m, apart, k);
                CHECK(error_of(model, F, dF, dC, modulus) < 1e-8);
                CHECK(error_of_transpose(model, F, dF, dC, modulus, random) < 1e-12);
            }
}

}  // namespace

TEMPLATE_TEST_CASE_SIG("dual numbers give the derivative of every material, at equal and at close stretches, too",
                       "[material][dual]", ((int D), D), 2, 3) {
    require_tangents<D>(NeoHookean<double>::from_young_poisson(1e6, 0.3), 1e6, {0.8, 0.9, 1, 1.3});
    require_tangents<D>(FixedCorotated<double>::from_young_poisson(1e6, 0.3), 1e6, {0.8, 0.9, 1, 1.3});
    require_tangents<D>(Hencky<double>::from_young_poisson(1e6, 0.3), 1e6, {0.8, 0.9, 1, 1.3});
    require_tangents<D>(Fluid<double>::from_properties({.viscosity = 1e3}), 1e5, {0.9, 0.97});
    // Snow is crushed below 0.975 and torn above 1.0075; the clamp of its stretches has a kink there.
    require_tangents<D>(Snow<double>::from_properties({}), 1.4e5, {0.9, 0.95, 1.1, 1.3});
    // At equal stretches von Mises has no shear and is elastic; with 0.04 between them it flows.
    require_tangents<D>(VonMises<double>::from_properties({}), 1e6, {0.5, 0.9, 1.3});
    // Under pressure, like von Mises. Where equal strains flow, the plastic strain has no derivative: mohr_coulomb.cpp.
    require_tangents<D>(MohrCoulomb<double>::from_properties({.young = 1e6, .dilatancy_angle = degrees(10)}), 1e6,
                        {0.5, 0.9});
    require_tangents<D>(Sand<double>::from_properties({}), 1e6, {0.5, 0.9, 1.3});
    require_tangents<D>(Nacc<double>::from_properties({}), 1e6, {0.5, 0.8, 1.3});
    // Crushed on the wet side, sheared on the dry side. Torn clay with a constant G is at the edge of flowing.
    require_tangents<D>(ModifiedCamClay<double>::from_properties({}), 1e6, {0.8, 0.9, 1, 1.3});
    require_tangents<D>(ModifiedCamClay<double>::from_properties({.shear_modulus = 1e6}), 1e6, {0.8, 0.9, 1});
    require_tangents<D>(Dissipating<Sand<double>>{Sand<double>::from_properties({})}, 1e6, {0.5, 1.3});
}

}  // namespace tangent_tests
