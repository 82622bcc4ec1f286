/// \file The elastic state of a material under a given stress.
#pragma once

#include <firn/core/dual.hpp>
#include <firn/core/error.hpp>
#include <firn/data/converted_state.hpp>
#include <firn/material/check.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/math/inverse.hpp>
#include <firn/stage/volume_filter.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Finds the elastic strains along the axes under which a material bears a Cauchy stress.
template <int D, class Material>
class ElasticStrain {
    using Dual = dual<double>;
    using OfDuals = with_scalar_t<Material, Dual>;
    using State = material_state_t<Material, D>;
    using StateOfDuals = material_state_t<OfDuals, D>;
    static constexpr bool is_fluid = has_volume_ratio<State>;
    /// Number of strains: 3 where F is 3 × 3, 1 for a fluid, else D.
    static constexpr int N = [] {
        if constexpr (is_fluid)
            return 1;
        else
            return firn::dimension_of<decltype(State::F)>;
    }();

public:
    using Strain = std::array<double, std::size_t(N)>;

    /// \param cauchy  σ along the axes [Pa];  \param start  has the other fields of the state
    ElasticStrain(const Material& material, const Vec<double, 3>& cauchy, const State& start)
        : material_(lift<Dual>(material)), start_(converted_state<StateOfDuals>(start)), sought_{} {
        for (int a = 0; a < N; ++a) sought_[std::size_t(a)] = cauchy[a];
    }

    /// Returns a state with these strains, as logarithms of stretches. \param state  has the other fields
    template <class T, class Strained>
    static Strained strained(Strained state, const std::array<T, std::size_t(N)>& strain) {
        if constexpr (is_fluid) {
            state.J = exp(strain[0]);
        } else {
            Mat<T, N> F = Mat<T, N>::zero();
            for (int a = 0; a < N; ++a) F(a, a) = exp(strain[std::size_t(a)]);
            state.F = F;
        }
        return state;
    }

    /// Returns the strains. \param found  gets whether there are some
    Strain find(bool& found) const {
        Strain strain{};
        double error = size_of(misfit(strain));
        const double enough = 1e-13 * std::max(size_of(sought_), error);
        for (int step = 0; step < 100 && error > enough; ++step) {
            const Strain change = newton_step(strain);
            double part = 1, best = error;
            Strain next = strain;
            for (; part > 1e-9; part /= 2) {  // so that stiff matter does not overshoot
                for (std::size_t a = 0; a < strain.size(); ++a) next[a] = strain[a] + part * change[a];
                best = size_of(misfit(next));
                if (best < error) break;
            }
            if (!(best < error)) break;  // rounding, or no strain bears this stress
            strain = next;
            error = best;
        }
        found = error <= 1e-9 * std::max(size_of(sought_), 1e-300);
        return strain;
    }

private:
    using Duals = std::array<Dual, std::size_t(N)>;

    static double size_of(const Strain& of) {
        double most = 0;
        for (const double x : of) most = std::isfinite(x) ? std::max(most, std::abs(x)) : HUGE_VAL;
        return most;
    }
    /// σ − the stress that is sought, with derivatives along strain `seed`.
    Duals misfit_along(const Strain& strain, std::size_t seed) const {
        Duals e;
        Dual sum(0);
        for (std::size_t a = 0; a < e.size(); ++a) {
            e[a] = Dual{strain[a], a == seed ? 1.0 : 0.0};
            sum += e[a];
        }
        const auto state = strained(start_, e);
        const auto tau = firn::kirchhoff_stress(material_, state);
        const Dual per_volume = exp(-sum);
        Duals misfit;
        for (int a = 0; a < N; ++a) {
            Dual along;
            if constexpr (N > D)
                along = a < D ? tau(a, a) : material_.output(state)[0];
            else
                along = tau(a, a);
            misfit[std::size_t(a)] = along * per_volume - Dual(sought_[std::size_t(a)]);
        }
        return misfit;
    }
    Strain misfit(const Strain& strain) const {
        Strain values;
        std::ranges::transform(misfit_along(strain, strain.size()), values.begin(), &Dual::value);
        return values;
    }
    /// Returns the step of Newton's method.
    Strain newton_step(const Strain& strain) const {
        Strain rest, step{};
        Mat<double, N> A;
        for (int j = 0; j < N; ++j) {
            const Duals along = misfit_along(strain, std::size_t(j));
            for (int i = 0; i < N; ++i) A(i, j) = along[std::size_t(i)].derivative;
            std::ranges::transform(along, rest.begin(), &Dual::value);
        }
        if constexpr (N == 1) {
            step[0] = -rest[0] / A(0, 0);
        } else {
            const Mat<double, N> inverse = inverse_transposed<double, N>(A);
            for (int i = 0; i < N; ++i)
                for (int j = 0; j < N; ++j) step[std::size_t(i)] -= inverse(j, i) * rest[std::size_t(j)];
        }
        return step;
    }

    OfDuals material_;
    StateOfDuals start_;
    Strain sought_;
};

}  // namespace detail

/// Returns the state in which a material that has never yielded bears a Cauchy stress along the axes. The elastic
/// strain is found by Newton's method with derivatives by dual numbers, so this serves any material whose state has a
/// deformation gradient F or a volume ratio J.
///
/// A particle in this state has J = det F times its initial volume: give it the initial volume V/J if V is its present
/// one. \see set_at_rest
/// \param material  with the scalar double
/// \param cauchy    σ along the axes [Pa], positive in tension. In two dimensions the third number is the stress across
///                  the plane: PlaneStrain bears it, other materials do not know it. A fluid takes the first number
/// \param start     has the other fields of the state
/// \throws parameter_error  if no elastic strain gives this stress, or if the material yields there
template <int D, class Material>
material_state_t<Material, D> elastic_state(const Material& material, const Vec<double, 3>& cauchy,
                                            const material_state_t<Material, D>& start) {
    using State = material_state_t<Material, D>;
    static_assert(has_volume<State>, "firn: elastic_state() needs a material whose state has F or J.");
    const detail::ElasticStrain<D, Material> elastic(material, cauchy, start);
    bool found = false;
    const auto strain = elastic.find(found);
    const auto refused = [&](const char* why) {
        throw parameter_error(sentence("The material ", name_of<Material>(), " cannot bear the stress (", cauchy[0],
                                       ", ", cauchy[1], ", ", cauchy[2], ") Pa along the axes: ", why));
    };
    if constexpr (has_volume_ratio<State>)
        for (int a = 1; a < D; ++a) found = found && cauchy[a] == cauchy[0];
    if (!found) refused("no elastic strain gives it. Tension is positive; a fluid bears the same along all axes.");
    const State state = elastic.strained(start, strain);
    const State after = updated(material, state, Mat<double, D>::zero(), 0.0);
    const double change = volume_change(after) - volume_change(state);
    bool yields = std::abs(change) > 1e-9;
    if constexpr (!has_volume_ratio<State>) yields = yields || squared_norm(after.F - state.F) > 1e-18;
    if (yields)
        refused(
            "it yields. Take a ratio of horizontal to vertical stress nearer to one, or more strength; where the "
            "surface bears nothing, a small surcharge helps.");
    return state;
}
/// Returns the state in which a new particle of a material bears a Cauchy stress along the axes.
template <int D, class Material>
material_state_t<Material, D> elastic_state(const Material& material, const Vec<double, 3>& cauchy) {
    return elastic_state<D>(material, cauchy, initial_state<D>(material));
}

}  // namespace firn::inline FIRN_BUILD
