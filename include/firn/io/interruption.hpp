/// \file After Ctrl-C or SIGTERM, lets a program complete its current step and write a last state before it ends.
#pragma once

#include <firn/core/build.hpp>

#include <csignal>

namespace firn::inline FIRN_BUILD {

/// A guard: while an object of this class exists, the signals SIGINT (Ctrl-C) and SIGTERM do not end the program. They
/// only set a flag, and requested() returns whether the flag is set:
///
///     firn::Interruption interruption;
///     while (simulation.time() < end && !interruption.requested()) simulation.step();
///     series.write(firn::state_of(simulation));
///
/// A second signal of the same kind calls the handler that was installed before this object was made. That handler
/// usually ends the program at once. The program may have at most one Interruption at a time. The destructor restores
/// the former handlers.
class [[nodiscard]] Interruption {
public:
    /// Installs handlers for SIGINT and SIGTERM, and clears the flag.
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

    bool requested() const { return flag() != 0; }  ///< Whether SIGINT or SIGTERM has arrived.
    static bool raised() { return flag() != 0; }    ///< Like requested(), without an object; false if there is none.
    int signal() const { return flag(); }           ///< The signal that arrived last, SIGINT or SIGTERM; 0 if none.

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

}  // namespace firn::inline FIRN_BUILD
