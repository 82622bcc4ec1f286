/// \file The gradient of a measure of a run: derivatives with the names that the program uses.
#pragma once

#include <firn/adjoint/measure.hpp>
#include <firn/simulation.hpp>

#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The derivatives by what the particles of one material had at the start, by id, and by the material's parameters. The
/// derivative by a quantity has the unit of the measure per unit of the quantity. Those of a particle that a source has
/// given are by what it had when it came in, at the end of a step. Those of ids without a particle are 0.
template <int D, class Material>
struct SetGradient {
    using State = material_state_t<with_scalar_t<Material, double>, D>;  ///< The state, of derivatives.

    std::vector<Vec<double, D>> position{},      ///< by the position [per m]; C, F and the stress are held
        velocity{};                              ///< by the velocity [per m/s]; C is held
    std::vector<Mat<double, D>> affine{};        ///< by the affine velocity matrix C [per 1/s]
    std::vector<double> mass{},                  ///< by the mass [per kg]; velocity, C and V0 are held
        volume{};                                ///< by the initial volume V0 [per m^D]; the mass is held
    std::vector<State> state{};                  ///< by the material's state; of F, the derivative by each component
    with_scalar_t<Material, double> material{};  ///< by each parameter of the material, for all particles
};

/// The derivative by a number that has a name.
using NamedDerivative = std::pair<std::string, double>;

/// The derivatives by the parameters of a load. \see differentiable_load
struct LoadGradient {
    LoadId load{};  ///< The load.
    /// By each number among the parameters() of its force, in their order, with its name.
    std::vector<NamedDerivative> parameters{};
};

/// The derivatives by what was set for an interval of time: from one call of advance() or step() to the next.
template <int D, class Boundary, class Transfer>
struct IntervalGradient {
    double from = 0;                                  ///< The time at which the interval begins [s].
    Vec<double, D> gravity = Vec<double, D>::zero();  ///< By the acceleration, if it was a vector [per m/s²].
    /// By each number among the parameters() of an acceleration field, in their order, with its name.
    std::vector<NamedDerivative> acceleration{};
    /// For each load that acted, in the order of the materials and of add_load(): the derivatives by its parameters.
    std::vector<LoadGradient> loads{};
    /// By each parameter of the boundary, and by the frictions of walls. The derivatives by the position and the
    /// rotation of a collider are those by what they are when the interval begins. They, and those by its velocities,
    /// count where the collider is in later intervals, too, as long as the program does not set it anew.
    with_scalar_t<Boundary, double> boundary{};
    with_scalar_t<Transfer, double> transfer{};  ///< By each parameter of the transfer.
};

namespace detail {
template <int D, class List>
struct set_gradients;
template <int D, class... M>
struct set_gradients<D, Materials<M...>> {
    using type = std::tuple<SetGradient<D, M>...>;
};
/// Calls f(number) for each number of a gradient that can be a direction.
template <class Any, class F>
void for_gradient(Any& gradient, const F& f) {
    const auto numbers = [&](auto& list) {
        for (auto& one : list)
            if constexpr (requires { one.m; })
                for (auto& number : one.m) f(number);
            else if constexpr (requires { one.v; })
                for (auto& number : one.v) f(number);
            else
                f(one);
    };
    std::apply(
        [&](auto&... set) {
            const auto go = [&](auto& of) {
                numbers(of.position), numbers(of.velocity), numbers(of.affine), numbers(of.mass), numbers(of.volume);
                for (auto& state : of.state) for_state(state, f);
                for_reals(of.material, f);
            };
            (go(set), ...);
        },
        gradient.sets);
    for (auto& interval : gradient.intervals) {
        for (auto& number : interval.gravity.v) f(number);
        for (auto& parameter : interval.acceleration) f(parameter.second);
        for (auto& load : interval.loads)
            for (auto& parameter : load.parameters) f(parameter.second);
        for_reals(interval.boundary, f);
        for_reals(interval.transfer, f);
    }
}

}  // namespace detail

/// The gradient of a measure.
template <class Simulation>
struct Gradient {
    static constexpr int D = Simulation::dimension;  ///< The dimension: 2 or 3.
    /// The derivatives by what was set for an interval.
    using OfInterval = IntervalGradient<D, decltype(Simulation::boundary), decltype(Simulation::transfer)>;

    /// For each material: the derivatives by what its particles had at the start, or when they came in, and by its
    /// parameters.
    typename detail::set_gradients<D, typename detail::listed<typename Simulation::material_type>::type>::type sets{};
    /// For each interval of time: the derivatives by what was set for it.
    std::vector<OfInterval> intervals{};
    /// For each state, from the start to the end: the norms of the adjoints of all positions [per m] and velocities
    /// [per m/s]. If they grow from the end to the start by orders of magnitude, the run is chaotic, and the gradient
    /// says little about changes that are not very small.
    std::vector<double> position_norm{}, velocity_norm{};  ///< \see position_norm

    /// Returns a gradient of the same kind whose numbers are all 0: a direction, to be filled. \see Adjoint::check
    Gradient zero() const {
        Gradient none = *this;
        detail::for_gradient(none, [](auto& number) { number = 0; });
        return none;
    }
    /// Returns the derivative along a direction: the sum of the products of all numbers, as far as they have a
    /// derivative.
    double along(const Gradient& direction) const {
        std::vector<double> by;
        detail::for_gradient(direction, [&](const auto& number) { by.push_back(double(number)); });
        double sum = 0;
        std::size_t next = 0;
        detail::for_gradient(*this, [&](const auto& number) {
            const double change = by[next++];
            if (change != 0) sum += double(number) * change;
        });
        return sum;
    }

    /// Returns the derivatives of material I, to be changed if this is a direction.
    /// @{
    template <std::size_t I = 0>
    auto& set() {
        return std::get<I>(sets);
    }
    template <std::size_t I = 0>
    const auto& set() const {
        return std::get<I>(sets);
    }
    /// @}
};

}  // namespace firn::inline FIRN_BUILD
