/// \file Sources, which add particles while a simulation runs, and sinks, which remove particles.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/recurrence.hpp>
#include <firn/data/samples.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace firn::inline FIRN_BUILD {

/// A source of particles, which adds them in bursts. Burst k = 0, 1, … is due at the time start + k / rate, if this
/// time is not after `end`. A burst that is due during a step is added at the end of the step. The particles of the
/// burst are then moved by their velocity times the time that has passed since the burst was due.
template <int D>
struct Source {
    Samples<D> samples;                                         ///< the particles of one burst
    double density = 1000;                                      ///< density of the particles [kg/m³]
    Vec<double, D> velocity{};                                  ///< velocity of the particles [m/s]
    double rate = 1;                                            ///< number of bursts per second [1/s]
    double start = 0;                                           ///< time of the first burst [s]
    double end = std::numeric_limits<double>::infinity();       ///< no burst is due after this time [s]
    double lifespan = std::numeric_limits<double>::infinity();  ///< age at which a particle is removed [s]
    std::uint64_t bursts = 0;                                   ///< number of bursts added so far
    int contact_group = 0;                                      ///< contact group of the particles

    /// Returns a source whose bursts form a jet without gaps. Each burst is a layer of particles. The distance between
    /// two layers, along the velocity, is `spacing`.
    /// \param layer     particles that fill a layer of thickness `spacing`, perpendicular to the velocity
    /// \param spacing   distance between two layers, and between neighbouring particles in a layer [m]
    /// \param density   density of the particles [kg/m³]
    /// \param velocity  velocity of the particles [m/s]
    /// \throws parameter_error  if the speed or the spacing is not positive and finite, or if a parameter of the source
    ///                          is out of range
    static Source jet(Samples<D> layer, double spacing, double density, const Vec<double, D>& velocity) {
        const double speed = norm(velocity);
        if (!(spacing > 0) || !std::isfinite(spacing) || !(speed > 0) || !std::isfinite(speed))
            throw parameter_error(sentence("A jet of speed ", speed, " m/s with layers ", spacing,
                                           " m apart: both must be positive and finite."));
        Source source{.samples = std::move(layer), .density = density, .velocity = velocity, .rate = speed / spacing};
        source.check();
        return source;
    }

    /// Checks the samples and parameters of the source.
    /// \throws parameter_error  if the source has no particles, or one of its parameters is out of range
    void check() const {
        if (samples.positions.empty()) throw parameter_error("A source has no particles to give. Sample a shape.");
        if (!(samples.volume > 0) || !std::isfinite(samples.volume) || !(density > 0) || !std::isfinite(density))
            throw parameter_error(sentence("A source gives particles of ", samples.volume, " m^", D, " and ", density,
                                           " kg/m^3; both must be positive and finite."));
        if (!std::isfinite(norm(velocity)))
            throw parameter_error(
                sentence("A source gives particles at ", norm(velocity), " m/s; their velocity must be finite."));
        recurrence().check(lifespan);
    }

    /// Returns the time at which a burst is due [s]. Bursts are numbered from 0.
    double time_of(std::uint64_t burst) const { return recurrence().time_of(burst); }
    /// Checks that there are enough unused ids for the particles of all bursts that are due at `time` [s].
    /// \param left  number of unused ids
    /// \throws parameter_error  if the bursts have more particles than there are unused ids
    void require_ids(double time, std::uint32_t left) const {
        recurrence().require_ids(bursts, time, double(samples.positions.size()), left);
    }
    /// Returns whether a burst that was not yet added is due at `time` [s].
    bool is_due(double time) const { return recurrence().is_due(bursts, time); }
    /// Skips the bursts that were due at `time` [s] or before: these bursts were already added, or they were due before
    /// the source existed.
    void skip(double time) { bursts = recurrence().first_after(bursts, time); }

private:
    detail::Recurrence recurrence() const { return {"A source", "bursts", rate, start, end}; }
};

/// A sink: a box. At the end of a step, every particle is removed that lies in the box or has come through it during
/// the step, on a straight way. A box may be as thin as a plane, with `lower` equal to `upper` along an axis.
template <int D>
struct Sink {
    Vec<double, D> lower{},  ///< Lower corner of the box [m].
        upper{};             ///< Upper corner of the box [m].

    /// Returns whether a position [m] lies in the box or on one of its faces.
    bool holds(const Vec<double, D>& x) const {
        bool inside = true;
        for (int a = 0; a < D; ++a) inside = inside && x[a] >= lower[a] && x[a] <= upper[a];
        return inside;
    }
    /// Returns whether the straight way between two positions [m] meets the box.
    bool is_on_the_way(const Vec<double, D>& from, const Vec<double, D>& to) const {
        if (holds(from) || holds(to)) return true;
        double enters = 0, leaves = 1;  // shares of the way
        for (int a = 0; a < D; ++a) {
            const double way = to[a] - from[a];
            if (way == 0) {
                if (from[a] < lower[a] || from[a] > upper[a]) return false;
                continue;
            }
            const double at_lower = (lower[a] - from[a]) / way, at_upper = (upper[a] - from[a]) / way;
            enters = std::max(enters, std::min(at_lower, at_upper));
            leaves = std::min(leaves, std::max(at_lower, at_upper));
        }
        return enters <= leaves;
    }
    /// Checks the corners of the box.
    /// \throws parameter_error  if, along an axis, `upper` is below `lower` or one of the two is NaN (infinite corners
    ///                          are allowed)
    void check() const {
        for (int a = 0; a < D; ++a)
            if (!(lower[a] <= upper[a]))
                throw parameter_error(sentence("A sink reaches from ", lower[a], " m to ", upper[a], " m along axis ",
                                               a, "; upper must not be below lower."));
    }
};

}  // namespace firn::inline FIRN_BUILD
