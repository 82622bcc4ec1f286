/// \file Lets a run's loop check for Ctrl-C and SIGTERM, so that the run can end with a complete last state.
#pragma once

#include <csignal>

namespace firn {

/// While it lives, SIGINT and SIGTERM only set a flag:
///
///     firn::Interruption interruption;
///     while (simulation.time() < end && !interruption.requested()) simulation.step();
///     series.write(firn::state_of(simulation));
///
/// A second signal of the same kind acts as it did before, and usually ends the program at once. Only one Interruption
/// may live at a time, on any thread. The destructor restores the former handlers.
class Interruption {
public:
    /// Installs the handlers and clears the flag.
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

    bool requested() const { return flag() != 0; }  ///< Whether a signal arrived.
    int signal() const { return flag(); }           ///< The last signal that arrived; 0 if none did.

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
