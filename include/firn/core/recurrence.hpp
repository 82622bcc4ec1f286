/// \file A schedule of events at a constant rate, for emitters and other sources of particles.
#pragma once

#include <firn/core/error.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace firn::inline FIRN_BUILD::detail {

/// A schedule of events. Event k = 0, 1, … happens at the time start + k / rate, unless this time is after `end`.
struct Recurrence {
    const char* owner;   ///< name of the source of particles in messages, e.g. "An emitter"
    const char* events;  ///< name of the events in messages, e.g. "births"
    double rate;         ///< number of events per second [1/s]
    double start;        ///< time of event 0 [s]
    double end;          ///< time after which no event happens [s]

    /// Checks the rate, the times and the lifespan of the particles.
    /// \param lifespan  lifespan of the particles [s]
    /// \throws parameter_error  if the rate, the times or the lifespan are out of range
    void check(double lifespan) const {
        if (!(rate > 0) || !std::isfinite(rate))
            throw parameter_error(
                sentence(owner, "'s rate is ", rate, " ", events, " a second; it must be positive and finite."));
        if (!std::isfinite(start) || !(end >= start))
            throw parameter_error(sentence(owner, " gives particles from ", start, " s to ", end,
                                           " s; the start must be finite and not after the end."));
        if (!(lifespan > 0))
            throw parameter_error(
                sentence(owner, "'s particles have a lifespan of ", lifespan, " s; it must be positive."));
    }

    /// Returns the time [s] of the event with index `event` = 0, 1, …
    double time_of(std::uint64_t event) const { return start + double(event) / rate; }
    /// Whether the event with index `event` happens at or before `time` [s].
    bool is_due(std::uint64_t event, double time) const { return time_of(event) <= time && time_of(event) <= end; }

    /// Returns how many of the events `first`, `first` + 1, … happen at or before `time` [s].
    /// \throws parameter_error  if 2⁵³ or more events, counted from event 0, happen at or before `time`
    double due(std::uint64_t first, double time) const {
        const double all = std::floor((std::min(time, end) - start) * rate) + 1;
        if (!(all < 0x1p53))
            throw parameter_error(sentence(owner, " of ", rate, " ", events, " a second from ", start, " s on owes ",
                                           all, " at ", time,
                                           " s, more than can be counted. Take a lower rate, or let it start later."));
        return std::max(all - double(first), 0.0);
    }

    /// Checks that enough ids are left for the particles of the events `first`, `first` + 1, … up to the last event at
    /// or before `time` [s].
    /// \param particles_of_event  number of particles that one event makes
    /// \param ids  number of ids that are left
    /// \throws parameter_error  if there are not enough ids, or if due() throws it
    void require_ids(std::uint64_t first, double time, double particles_of_event, std::uint32_t ids) const {
        if (const double owed = due(first, time) * particles_of_event; owed > double(ids))
            throw parameter_error(sentence(owner, " of ", rate, " ", events, " a second owes ", owed, " particles at ",
                                           time, " s; there are ids for ", ids,
                                           " more. Take a lower rate, or let it start later."));
    }

    /// Returns the index of the next event after `time` [s]: the smallest index ≥ `first` for which is_due(index, time)
    /// is false.
    /// \throws parameter_error  if due() throws it
    std::uint64_t first_after(std::uint64_t first, double time) const {
        // due() rounds, so the last events are checked one by one.
        if (const double most = due(first, time) * (1 - 1e-12); most > 2) first += std::uint64_t(most - 2);
        while (is_due(first, time)) ++first;
        return first;
    }
};

}  // namespace firn::inline FIRN_BUILD::detail
