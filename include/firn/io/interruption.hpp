/// \file Lets a program end its run after Ctrl-C or SIGTERM when the current step is complete, and write a last state.
#pragma once

#include <csignal>

namespace firn {

/// While an object of this class exists, the signals SIGINT (Ctrl-C) and SIGTERM do not end the program. They set a
/// flag that requested() returns:
///
///     firn::Interruption interruption;
///     while (simulation.time() < end && !interruption.requested()) simulation.step();
///     series.write(firn::state_of(simulation));
///
/// A second signal of the same kind calls the former handler, which usually ends the program at once. At most one
/// Interruption may exist at a time in the program. The destructor restores the former handlers.
class Interruption {
public:
    /// Installs handlers for both signals, and clears the flag.
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

    bool requested() const { return flag() != 0; }  ///< Whether one of the signals has arrived.
    int signal() const { return flag(); }           ///< SIGINT or SIGTERM, whichever arrived last; 0 if none has.

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
