/// \file Events at a steady rate: the schedule of whatever gives particles.
#pragma once

#include <firn/core/error.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace firn::detail {

/// Event k happens at start + k / rate, unless that is after `end`.
struct Recurrence {
    const char* owner;   ///< "An emitter"
    const char* events;  ///< "births"
    double rate;         ///< [1/s]
    double start;        ///< [s]
    double end;          ///< [s]

    /// \param lifespan  of what is given [s]
    /// \throws parameter_error  unless numbers are in range
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

    double time_of(std::uint64_t event) const { return start + double(event) / rate; }
    bool is_due(std::uint64_t event, double time) const { return time_of(event) <= time && time_of(event) <= end; }

    /// How many events from number `first` on are due until `time`.
    /// \throws parameter_error  if they are more than can be counted
    double due(std::uint64_t first, double time) const {
        const double all = std::floor((std::min(time, end) - start) * rate) + 1;
        if (!(all < 0x1p53))
            throw parameter_error(sentence(owner, " of ", rate, " ", events, " a second from ", start, " s on owes ",
                                           all, " at ", time,
                                           " s, more than can be counted. Take a lower rate, or let it start later."));
        return std::max(all - double(first), 0.0);
    }

    /// \param ids  that are left
    /// \throws parameter_error  if the particles of the events that are due from number `first` on are more
    void require_ids(std::uint64_t first, double time, double particles_of_event, std::uint32_t ids) const {
        if (const double owed = due(first, time) * particles_of_event; owed > double(ids))
            throw parameter_error(sentence(owner, " of ", rate, " ", events, " a second owes ", owed, " particles at ",
                                           time, " s; there are ids for ", ids,
                                           " more. Take a lower rate, or let it start later."));
    }

    /// The first event from number `first` on that is not due until `time`. \throws parameter_error, as due()
    std::uint64_t first_after(std::uint64_t first, double time) const {
        // due() rounds: the last ones are looked at.
        if (const double most = due(first, time) * (1 - 1e-12); most > 2) first += std::uint64_t(most - 2);
        while (is_due(first, time)) ++first;
        return first;
    }
};

}  // namespace firn::detail
