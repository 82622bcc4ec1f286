/// \file Messages about a failed step: which particles have a value that is not finite or have left the domain, and the
/// likely cause.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/lanes.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/loops/grid_update.hpp>
#include <firn/loops/wrong_particles.hpp>
#include <firn/simulation/set_of.hpp>

#include <cmath>
#include <limits>
#include <string>

namespace firn::inline FIRN_BUILD::detail {

/// Checks an acceleration.
/// \throws parameter_error  if a constant acceleration, or a parameter of an acceleration field, is not finite
template <int D, class Acceleration>
void check_acceleration(const Acceleration& acceleration) {
    if constexpr (requires { acceleration.check(); }) acceleration.check();
    if constexpr (has_parameters<Acceleration>) {
        for_parameters(acceleration, [](const std::string& name, const char* unit, const auto& value) {
            const auto one = [&](double number) {
                if (!std::isfinite(number))
                    throw parameter_error(sentence("The ", name, " of the acceleration field is ", number, " ", unit,
                                                   "; it must be finite."));
            };
            if constexpr (requires { double(value); })
                one(double(value));
            else
                for (const auto& number : value.v) one(double(number));
        });
    } else if constexpr (requires { acceleration.v[D - 1]; }) {
        for (int a = 0; a < D; ++a)
            if (!std::isfinite(double(acceleration[a])))
                throw parameter_error(sentence("Component ", a,
                                               " of the acceleration (of gravity, unless another is "
                                               "given to the step) is ",
                                               double(acceleration[a]), " m/s^2; it must be finite."));
    }
}

/// Looks for nodes with mass where the acceleration is not finite, or would move matter at rest by more than `most` [m]
/// in a step of dt [s]. Returns a sentence about the first such node; an empty string if there is none.
template <std::floating_point S, int D, class Acceleration>
[[gnu::cold]] std::string wrong_acceleration(const SparseGrid<S, D>& grid, double dt, const Acceleration& acceleration,
                                             double most) {
    using P = native_pack<S>;
    const Vec<double, D> corner = grid.domain().lower;
    const auto field = lifted_acceleration<P>(acceleration, corner);
    for (std::size_t b = 0; b < grid.block_count(); ++b)
        for (int i = 0; i < block_nodes<D>; ++i) {
            if (!(grid.nodes(b)[i * node_width + node_mass] > 0)) continue;
            Vec<P, D> x;
            Vec<double, D> at{}, found{};
            for (int a = 0; a < D; ++a) {
                at[a] = position_of_place(grid.domain(), grid.block(b), a, i >> (2 * (D - 1 - a)) & (block_size - 1));
                x.v[a] = P(S(at[a] - corner[a]));
            }
            const Vec<P, D> of_node = acceleration_at(field, x, Vec<P, D>::zero(), P(S(dt)));
            bool finite = true, small = true;
            for (int a = 0; a < D; ++a) {
                found[a] = double(lane_value(of_node.v[a], 0));
                finite = finite && std::isfinite(found[a]);
                small = small && std::abs(found[a]) * dt * dt <= most;
            }
            if (finite && small) continue;
            return sentence("The acceleration at ", point_text(at.v, D), " m is ", point_text(found.v, D), " m/s^2, ",
                            finite ? "which moves matter by more than a cell in one step: take a smaller step."
                                   : "which is not finite: look at the field that was given.");
        }
    return {};
}

/// Returns a sentence about the likely cause of a failed step: the acceleration, a time step above the bound, or the
/// state of the particles.
/// \param bound  the bound of the time step (the largest stable step), as computed before the step [s]
template <std::floating_point S, int D, class Acceleration>
[[gnu::cold]] std::string likely_cause(const SparseGrid<S, D>& grid, double dt, double bound,
                                       const Acceleration& acceleration) {
    const auto acts = [&](double most) { return wrong_acceleration(grid, dt, acceleration, most); };
    if (const std::string text = acts(std::numeric_limits<double>::infinity()); !text.empty()) return text;
    if (dt > bound * (1 + 1e-9))
        return sentence("The step is ", dt / bound, " times the bound of the time step, ", bound,
                        " s: leave fixed_time_step at 0, or give one below the bound.");
    if (const std::string text = acts(grid.domain().cell_size); !text.empty()) return text;
    return sentence("The step is ", dt / bound, " times the bound of the time step, ", bound,
                    " s: look for a load, a velocity, a state set by hand or a stiffness that is too large.");
}

/// Returns sentences about the particle with the largest signal speed of all sets.
/// \param sets  the particles of these sets must be sorted into blocks
/// \param at_least  if no particle is as fast as this [m/s], the result is empty
template <std::floating_point S, int D>
std::string fastest_particle(SetList<S, D>& sets, double at_least);

/// Throws a particle_error about particles that have a value that is not finite, or that have left the domain. The
/// message describes such particles of the first set that has any.
/// \param when   beginning of the message;  \param cause  end of the message
/// \param dt     time step that moved the particles [s]; 0 if no step moved them, but the program set their values
template <std::floating_point S, int D>
[[noreturn, gnu::cold]] void throw_wrong_particles(SetList<S, D>& sets, const std::string& when, double dt,
                                                   const std::string& cause);

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/simulation/blow_up-inl.hpp>
#endif
