/// \file Records what a rank does when: computing, packing, waiting.
#pragma once

#include <firn/core/requirements.hpp>

#include <cstdint>
#include <ctime>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi {

/// What a rank did, as a list of phases with their times. Give it to Distributed::trace to measure a run.
struct Trace {
    /// One phase of the work.
    struct Event {
        const char* what;  ///< name of the phase
        double begin,      ///< begin [s], on a clock that all ranks of one machine share
            end,           ///< end [s]
            cpu;           ///< processor time that the calling thread spent in it [s]
        bool waits;        ///< whether the rank only waited for others
    };
    std::vector<Event> events{};      ///< the phases, in the order in which they ended
    std::uint64_t bytes_sent = 0;     ///< bytes of the messages sent with sums, and with sums back
    std::uint64_t messages_sent = 0;  ///< number of these messages

    /// Returns the processor time that was spent waiting [s].
    double waited() const {
        double sum = 0;
        for (const Event& event : events) sum += event.waits ? event.cpu : 0;
        return sum;
    }
};

namespace detail {

inline double seconds_of(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Adds a phase to a trace when it is destroyed. Without a trace it does nothing.
class Phase {
public:
    Phase(Trace* trace, const char* what, bool waits = false) : trace_(trace) {
        if (trace_) event_ = {what, seconds_of(CLOCK_MONOTONIC), 0, seconds_of(CLOCK_THREAD_CPUTIME_ID), waits};
    }
    Phase(const Phase&) = delete;
    Phase& operator=(const Phase&) = delete;
    ~Phase() {
        if (!trace_) return;
        event_.end = seconds_of(CLOCK_MONOTONIC);
        event_.cpu = seconds_of(CLOCK_THREAD_CPUTIME_ID) - event_.cpu;
        trace_->events.push_back(event_);
    }

private:
    Trace* trace_;
    Trace::Event event_{};
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD::mpi
