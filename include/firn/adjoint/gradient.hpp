/// \file The gradient of a measure of a run: derivatives with the names that the program uses.
#pragma once

#include <firn/simulation.hpp>

#include <string>
#include <tuple>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The derivatives by what the particles of one material had at the start, by id, and by the material's parameters. The
/// derivative by a quantity has the unit of the measure per unit of the quantity.
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

/// The derivatives by what was set for an interval of time: from one call of advance() or step() to the next.
template <int D, class Boundary, class Transfer>
struct IntervalGradient {
    double from = 0;                                  ///< The time at which the interval begins [s].
    Vec<double, D> gravity = Vec<double, D>::zero();  ///< By the acceleration, if it was a vector [per m/s²].
    /// By each number among the parameters() of an acceleration field, in their order, with its name.
    std::vector<std::pair<std::string, double>> acceleration{};
    with_scalar_t<Boundary, double> boundary{};  ///< By each parameter of the boundary that is no `double`.
    with_scalar_t<Transfer, double> transfer{};  ///< By each parameter of the transfer.
};

namespace detail {
template <int D, class List>
struct set_gradients;
template <int D, class... M>
struct set_gradients<D, Materials<M...>> {
    using type = std::tuple<SetGradient<D, M>...>;
};
}  // namespace detail

/// The gradient of a measure.
template <class Simulation>
struct Gradient {
    static constexpr int D = Simulation::dimension;  ///< The dimension: 2 or 3.

    /// For each material: the derivatives by what its particles had at the start, and by its parameters.
    typename detail::set_gradients<D, typename detail::listed<typename Simulation::material_type>::type>::type sets{};
    /// For each interval of time: the derivatives by what was set for it.
    std::vector<IntervalGradient<D, decltype(Simulation::boundary), decltype(Simulation::transfer)>> intervals{};
    /// For each state, from the start to the end: the norms of the adjoints of all positions [per m] and velocities
    /// [per m/s]. If they grow from the end to the start by orders of magnitude, the run is chaotic, and the gradient
    /// says little about changes that are not very small.
    std::vector<double> position_norm{}, velocity_norm{};  ///< \see position_norm

    /// Returns the derivatives of material I.
    template <std::size_t I = 0>
    const auto& set() const {
        return std::get<I>(sets);
    }
};

}  // namespace firn::inline FIRN_BUILD
