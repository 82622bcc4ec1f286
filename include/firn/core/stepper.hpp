/// \file What every run has, on a grid or without: a clock, gravity, where warnings go, and steps one after the other.
#pragma once

#include <firn/core/step_region.hpp>
#include <firn/core/tensor.hpp>

#include <cstdio>
#include <functional>
#include <string>
#include <utility>

namespace firn {

/// After which step a run is.
struct Moment {
    double time = 0;  ///< [s]
    std::uint64_t steps = 0;
    double last_time_step = 0;  ///< size of the step that led here [s]; 0: none did

    bool operator==(const Moment&) const = default;
};

namespace detail {
inline void warn_on_stderr(const std::string& text) { std::fprintf(stderr, "firn: %s\n", text.c_str()); }
}  // namespace detail

template <int D>
class Stepper {
public:
    Vec<double, D> gravity = Vec<double, D>::zero();  ///< [m/s²]; −9.81 along y unless changed
    /// Takes warnings, each once. By default they go to stderr; empty: nowhere. It is called outside any parallel
    /// region, before the step that it warns of.
    std::function<void(const std::string&)> warn = detail::warn_on_stderr;

    double time() const { return now_.time; }  ///< [s]
    std::uint64_t steps() const { return now_.steps; }
    double last_time_step() const { return now_.last_time_step; }  ///< [s]
    Moment moment() const { return now_; }

protected:
    Stepper() { gravity[1] = -9.81; }

    /// Takes steps until is_done() says so. They share parallel regions, each of which is left where something of the
    /// user's is to be called.
    /// \param workers    of a region
    /// \param last_step  no region goes further
    /// \param step       step(warning): takes one, or leaves a warning and takes none
    template <class IsDone, class Step>
    void take_steps(int workers, std::uint64_t last_step, const IsDone& is_done, const Step& step) {
        std::string warning;
        while (!is_done()) {
            const std::uint64_t most = detail::regions_span_steps() ? last_step - now_.steps : 1;
            detail::steps_region(workers, most, helpers_, [&](std::uint64_t wanted) {
                std::uint64_t taken = 0;
                for (; taken < wanted && !is_done(); ++taken) {
                    step(warning);
                    if (!warning.empty()) break;
                }
                return taken;
            });
            if (!warning.empty()) warn(std::exchange(warning, {}));
        }
    }

    Moment now_;

private:
    detail::StepHelpers helpers_;
};

}  // namespace firn
