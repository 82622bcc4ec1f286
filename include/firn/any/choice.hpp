/// \file What a simulation is made of, chosen at run time by names.
#pragma once

#include <firn/any/boundary.hpp>
#include <firn/any/properties.hpp>
#include <firn/data/domain.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A material by its name, with numbers by their names.
struct MaterialChoice {
    std::string name = "fixed_corotated";  ///< as in states: "sand"
    /// Measurable properties, as from_properties() or from_young_poisson() takes them: "young" [Pa], "poisson" [1],
    /// "friction_angle" [degrees]. Those that are not given have the defaults of these functions, or young = 1e5 Pa and
    /// poisson = 0.3. If none is given, the material has the default values of its type.
    std::vector<NamedNumber> properties{};
    /// Parameters of the model, as in states: "mu" [Pa], "friction_angle" [rad]. They are set after the properties.
    std::vector<NamedNumber> parameters{};

    bool operator==(const MaterialChoice&) const = default;
};

/// Everything that AnySimulation is made of, except the particles.
template <int D>
struct SimulationChoice {
    Domain<D> domain{};                                       ///< The domain.
    std::string precision = "float";                          ///< "float" or "double".
    std::string transfer = "apic";                            ///< The transfer, as in states.
    std::vector<NamedNumber> transfer_parameters{};           ///< Parameters of the transfer, such as those of "aflip".
    std::string kernel = "quadratic_b_spline";                ///< The kernel, as in states.
    std::string force = "mls";                                ///< The force form, as in states.
    std::vector<MaterialChoice> materials{MaterialChoice{}};  ///< The materials; each has a set of particles.
    /// The parts of the boundary. If it is not given, there are walls on all faces of the domain except those of
    /// periodic axes, from which matter can separate.
    std::optional<std::vector<BoundaryPart<D>>> boundary{};
    std::optional<Vec<double, D>> gravity{};     ///< Gravity [m/s²]; if it is not given, −9.81 along y.
    double fixed_time_step = 0;                  ///< The time step [s]; 0: the bound. \see RunOf::fixed_time_step
    std::uint64_t most_steps_between_sorts = 0;  ///< \see RunOf::most_steps_between_sorts
    int threads = 0;                             ///< Number of threads; 0: all of the machine.
};

}  // namespace firn::inline FIRN_BUILD
