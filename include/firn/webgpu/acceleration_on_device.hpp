/// \file The acceleration that steps on a device have.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/simulation/acceleration.hpp>
#include <firn/simulation/blow_up.hpp>
#include <firn/webgpu/from_corner.hpp>
#include <firn/webgpu/host.hpp>
#include <firn/webgpu/programs_of_sets.hpp>

#include <cstddef>
#include <functional>
#include <string>
#include <typeinfo>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// An acceleration of steps of a simulation on a device, without its type.
template <class Simulation>
struct AnyAcceleration {
    const std::type_info* type = nullptr;
    std::vector<double> numbers{};  ///< its parameters. \see numbers_of
    double size = -1;               ///< if it is the same everywhere: its size [m/s²], in float; else −1
    /// Returns the program of set k.
    std::function<wgsl::Program(const Simulation&, std::size_t k, const wgsl::ProgramOptions&)> make_program{};
    std::function<void(const Simulation&, Host& grid)> give{};  ///< Gives its parameters to the device.
    std::function<double(Simulation&)> find_bound{};            ///< Returns the bound of the time step [s].
    /// Returns the likely cause of wrong particles after a step of dt [s].
    std::function<std::string(const Simulation&, double dt, double bound)> likely_cause{};

    /// Makes it, of none.
    AnyAcceleration() = default;
    /// Makes it from an acceleration: a vector or a field. \param bound  becomes find_bound
    template <class Acceleration, class Bound>
    AnyAcceleration(const Acceleration& acceleration, const Bound& bound)
        : type(&typeid(Acceleration)), numbers(numbers_of(acceleration)), find_bound(bound) {
        if constexpr (firn::detail::is_uniform<Acceleration>) size = firn::detail::size_of_uniform(acceleration, true);
        const auto there = [acceleration](const Simulation& of) {
            using Boundary = std::remove_cvref_t<decltype(of.boundary)>;
            return field_from_corner<Boundary>(acceleration, of.domain());
        };
        make_program = [there](const Simulation& of, std::size_t k, const wgsl::ProgramOptions& options) {
            if constexpr (firn::detail::is_field_in_metres<decltype(there(of))>)
                firn::detail::require_digits<float>(of.domain(), "An acceleration field of your own");
            return program_of_set(of, k, there(of), options);
        };
        give = [there](const Simulation& of, Host& grid) { grid.set_parameters(there(of), "field"); };
        likely_cause = [acceleration](const Simulation& of, double dt, double of_step) {
            return firn::detail::likely_cause(of.grid(), dt, of_step, acceleration);
        };
    }

    /// Returns whether it was made from an acceleration of this type.
    template <class Acceleration>
    bool is_a() const {
        return type && *type == typeid(Acceleration);
    }
};

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
