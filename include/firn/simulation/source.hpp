/// \file Where particles come from and where they go while a simulation runs.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/recurrence.hpp>
#include <firn/data/samples.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace firn {

/// Gives particles in bursts: number k at start + k / rate, for as long as that is not after `end`. A burst that was
/// due within a step stands, after it, where it would have flown to.
template <int D>
struct Source {
    Samples<D> samples;                                         ///< of one burst
    double density = 1000;                                      ///< [kg/m³; kg/m² in 2D]
    Vec<double, D> velocity{};                                  ///< [m/s]
    double rate = 1;                                            ///< bursts a second [1/s]
    double start = 0;                                           ///< [s]
    double end = std::numeric_limits<double>::infinity();       ///< [s]
    double lifespan = std::numeric_limits<double>::infinity();  ///< after so long a particle is taken out [s]
    std::uint64_t bursts = 0;                                   ///< given so far

    /// A jet without gaps: bursts of a layer of particles, `spacing` [m] apart along the velocity.
    /// \param layer  particles that fill a layer as thick as one spacing, across the velocity
    /// \throws parameter_error, as check(); or without a velocity
    static Source jet(Samples<D> layer, double spacing, double density, const Vec<double, D>& velocity) {
        const double speed = norm(velocity);
        if (!(spacing > 0) || !std::isfinite(spacing) || !(speed > 0) || !std::isfinite(speed))
            throw parameter_error(sentence("A jet of speed ", speed, " m/s with layers ", spacing,
                                           " m apart: both must be positive and finite."));
        Source source{.samples = std::move(layer), .density = density, .velocity = velocity, .rate = speed / spacing};
        source.check();
        return source;
    }

    /// \throws parameter_error unless there are particles, and numbers are in range
    void check() const {
        if (samples.positions.empty()) throw parameter_error("A source has no particles to give. Sample a shape.");
        if (!(samples.volume > 0) || !std::isfinite(samples.volume) || !(density > 0) || !std::isfinite(density))
            throw parameter_error(sentence("A source gives particles of ", samples.volume, " m^", D, " and ", density,
                                           " kg/m^", D, "; both must be positive and finite."));
        if (!std::isfinite(norm(velocity)))
            throw parameter_error(
                sentence("A source gives particles at ", norm(velocity), " m/s; their velocity must be finite."));
        recurrence().check(lifespan);
    }

    double time_of(std::uint64_t burst) const { return recurrence().time_of(burst); }
    /// \throws parameter_error  if the bursts that a step to `time` gives are of more particles than there are ids left
    void require_ids(double time, std::uint32_t left) const {
        recurrence().require_ids(bursts, time, double(samples.positions.size()), left);
    }
    bool is_due(double time) const { return recurrence().is_due(bursts, time); }
    /// Those due until `time`, it included, are not given: they have been, or the source was not there.
    void skip(double time) { bursts = recurrence().first_after(bursts, time); }

private:
    detail::Recurrence recurrence() const { return {"A source", "bursts", rate, start, end}; }
};

/// Takes out every particle that is in a box after a step.
template <int D>
struct Sink {
    Vec<double, D> lower{}, upper{};  ///< [m]

    bool holds(const Vec<double, D>& x) const {
        bool inside = true;
        for (int a = 0; a < D; ++a) inside = inside && x[a] >= lower[a] && x[a] <= upper[a];
        return inside;
    }
    /// \throws parameter_error unless lower ≤ upper (infinite is allowed)
    void check() const {
        for (int a = 0; a < D; ++a)
            if (!(lower[a] <= upper[a]))
                throw parameter_error(sentence("A sink reaches from ", lower[a], " m to ", upper[a], " m along axis ",
                                               a, "; upper must not be below lower."));
    }
};

}  // namespace firn
