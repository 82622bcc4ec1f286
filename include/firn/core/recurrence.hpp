/// \file Events at a steady rate.
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

    /// The first event from number `first` on that is not due until `time`. \throws parameter_error, as due()
    std::uint64_t first_after(std::uint64_t first, double time) const {
        // due() rounds: the last ones are looked at.
        if (const double most = due(first, time) * (1 - 1e-12); most > 2) first += std::uint64_t(most - 2);
        while (is_due(first, time)) ++first;
        return first;
    }
};

}  // namespace firn::detail
