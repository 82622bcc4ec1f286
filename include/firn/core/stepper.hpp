/// \file The base class of simulations on a grid and of particle systems: time, gravity, warnings and steps.
#pragma once

#include <firn/core/step_region.hpp>
#include <firn/core/tensor.hpp>

#include <cstdio>
#include <functional>
#include <string>

namespace firn::inline FIRN_BUILD {

/// How far a run has come: its time and its number of steps.
struct Moment {
    double time = 0;            ///< time that the run has reached [s]
    std::uint64_t steps = 0;    ///< number of steps so far
    double last_time_step = 0;  ///< size of the last step [s]; 0 before the first one

    bool operator==(const Moment&) const = default;
};

namespace detail {
inline void warn_on_stderr(const std::string& text) { std::fprintf(stderr, "firn: %s\n", text.c_str()); }
}  // namespace detail

/// Base of Simulation and ParticleSystem: time, gravity, warnings and steps.
template <int D>
class Stepper {
public:
    Vec<double, D> gravity = Vec<double, D>::zero();  ///< Gravity [m/s²]; −9.81 along y unless changed.
    /// Function that is called with the text of each warning, once per warning. The function is called outside of
    /// parallel regions, before the step that the warning is about. By default the function writes to stderr. If the
    /// std::function is empty, there are no warnings.
    std::function<void(const std::string&)> warn = detail::warn_on_stderr;

    double time() const { return now_.time; }                      ///< Time that the run has reached [s].
    std::uint64_t steps() const { return now_.steps; }             ///< Number of steps so far.
    double last_time_step() const { return now_.last_time_step; }  ///< Size of the last step [s]; 0 before the first.
    Moment moment() const { return now_; }                         ///< Time and number of steps so far.

protected:
    Stepper() { gravity[1] = -9.81; }

    /// Takes steps until is_done() returns true. Many steps share one parallel region, but a region ends before a
    /// function of the user (e.g. `warn`) is called.
    /// \param workers    number of workers of a region
    /// \param last_step  a region ends at the latest when the run has taken this many steps
    /// \param is_done    is_done() returns true when no further step is to be taken
    /// \param step       step(warning) takes one step; or it writes a text to `warning` and takes no step
    template <class IsDone, class Step>
    void take_steps(int workers, std::uint64_t last_step, const IsDone& is_done, const Step& step) {
        run_steps(workers, last_step, std::ref(is_done), std::ref(step));  // no allocations in each step()
    }

    bool speaks_ = true;  ///< Whether warnings are given: of several processes, only one gives them.
    Moment now_;          ///< Time and number of steps so far, and the size of the last step.

private:
    /// Does the work of take_steps().
    void run_steps(int workers, std::uint64_t last_step, const std::function<bool()>& is_done,
                   const std::function<void(std::string&)>& step);

    detail::StepHelpers helpers_;
};

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/core/stepper-inl.hpp>
#endif
