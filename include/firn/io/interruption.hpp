/// \file Ctrl-C and SIGTERM as a question that a run's loop asks, so that it ends with a complete last state.
#pragma once

#include <csignal>

namespace firn {

/// While it lives, SIGINT and SIGTERM only raise a flag:
///
///     firn::Interruption interruption;
///     while (simulation.time() < end && !interruption.requested()) simulation.step();
///     series.write(firn::state_of(simulation));
///
/// A second signal of the kind does what it did before: as a rule it ends the program at once. One at a time, on
/// whatever thread; what stood before comes back at the end.
class Interruption {
public:
    Interruption() : interrupt_(std::signal(SIGINT, raise_flag)), terminate_(std::signal(SIGTERM, raise_flag)) {
        before(SIGINT) = interrupt_;
        before(SIGTERM) = terminate_;
        flag() = 0;
    }
    Interruption(const Interruption&) = delete;
    Interruption& operator=(const Interruption&) = delete;
    ~Interruption() {
        std::signal(SIGINT, interrupt_);
        std::signal(SIGTERM, terminate_);
    }

    bool requested() const { return flag() != 0; }
    /// The signal that came; 0: none.
    int signal() const { return flag(); }

private:
    using Handler = void (*)(int);

    static volatile std::sig_atomic_t& flag() {
        static volatile std::sig_atomic_t raised = 0;
        return raised;
    }
    static Handler& before(int signal) {
        static Handler handlers[2] = {SIG_DFL, SIG_DFL};
        return handlers[signal == SIGTERM];
    }
    static void raise_flag(int signal) {
        flag() = signal;
        std::signal(signal, before(signal));
    }

    Handler interrupt_, terminate_;
};

}  // namespace firn
