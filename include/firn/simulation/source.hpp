/// \file Sources, which give particles while a simulation runs, and sinks, which take them out.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/recurrence.hpp>
#include <firn/data/samples.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace firn {

/// A source gives particles in bursts: burst k at the time start + k / rate, unless that is after `end`. A burst that
/// is due within a step is added after the step, at the place to which it would have flown by then.
template <int D>
struct Source {
    Samples<D> samples;                                         ///< of one burst
    double density = 1000;                                      ///< [kg/m³; kg/m² in 2D]
    Vec<double, D> velocity{};                                  ///< [m/s]
    double rate = 1;                                            ///< bursts a second [1/s]
    double start = 0;                                           ///< of the first burst [s]
    double end = std::numeric_limits<double>::infinity();       ///< no burst after it [s]
    double lifespan = std::numeric_limits<double>::infinity();  ///< a particle is taken out at this age [s]
    std::uint64_t bursts = 0;                                   ///< number of bursts given so far

    /// A jet without gaps: bursts of a layer of particles, one spacing apart along the velocity.
    /// \param layer     particles that fill a layer across the velocity, as thick as one spacing
    /// \param spacing   [m]
    /// \param density   [kg/m³; kg/m² in 2D]
    /// \param velocity  [m/s]
    /// \throws parameter_error  if the velocity is zero, or as check()
    static Source jet(Samples<D> layer, double spacing, double density, const Vec<double, D>& velocity) {
        const double speed = norm(velocity);
        if (!(spacing > 0) || !std::isfinite(spacing) || !(speed > 0) || !std::isfinite(speed))
            throw parameter_error(sentence("A jet of speed ", speed, " m/s with layers ", spacing,
                                           " m apart: both must be positive and finite."));
        Source source{.samples = std::move(layer), .density = density, .velocity = velocity, .rate = speed / spacing};
        source.check();
        return source;
    }

    /// \throws parameter_error  if there are no particles, or a number is out of range
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

    /// The time of a burst, counted from 0 [s].
    double time_of(std::uint64_t burst) const { return recurrence().time_of(burst); }
    /// Checks that there are enough ids for the bursts due at `time` [s].
    /// \param left  number of ids that are left
    /// \throws parameter_error  if the bursts have more particles
    void require_ids(double time, std::uint32_t left) const {
        recurrence().require_ids(bursts, time, double(samples.positions.size()), left);
    }
    bool is_due(double time) const { return recurrence().is_due(bursts, time); }  ///< Whether the next burst is due.
    /// Skips the bursts that are due at `time` [s] or before: they were given already, or the source did not exist.
    void skip(double time) { bursts = recurrence().first_after(bursts, time); }

private:
    detail::Recurrence recurrence() const { return {"A source", "bursts", rate, start, end}; }
};

/// A sink takes out every particle that lies in its box after a step.
template <int D>
struct Sink {
    Vec<double, D> lower{},  ///< Lower corner of the box [m].
        upper{};             ///< Upper corner of the box [m].

    /// Whether a position [m] lies in the box, faces included.
    bool holds(const Vec<double, D>& x) const {
        bool inside = true;
        for (int a = 0; a < D; ++a) inside = inside && x[a] >= lower[a] && x[a] <= upper[a];
        return inside;
    }
    /// \throws parameter_error  unless lower ≤ upper along each axis (infinite is allowed)
    void check() const {
        for (int a = 0; a < D; ++a)
            if (!(lower[a] <= upper[a]))
                throw parameter_error(sentence("A sink reaches from ", lower[a], " m to ", upper[a], " m along axis ",
                                               a, "; upper must not be below lower."));
    }
};

}  // namespace firn
