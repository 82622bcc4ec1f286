/// \file Signals that end a run are asked for, not obeyed at once; the second one is.
#include "support/catch.hpp"
#include <firn/io/interruption.hpp>

namespace {
volatile std::sig_atomic_t reached_old_handler = 0;
}

TEST_CASE("Ctrl-C and SIGTERM are kept for the run's loop, a second one goes where it went before", "[io]") {
    const auto mine = [](int signal) { reached_old_handler = signal; };
    const auto before = std::signal(SIGTERM, mine);
    {
        const firn::Interruption interruption;
        CHECK_FALSE(interruption.requested());
        std::raise(SIGTERM);
        CHECK(interruption.requested());
        CHECK(interruption.signal() == SIGTERM);
        CHECK(reached_old_handler == 0);
        std::raise(SIGTERM);
        CHECK(reached_old_handler == SIGTERM);
        std::raise(SIGINT);
        CHECK(interruption.signal() == SIGINT);
    }
    const firn::Interruption afresh;
    CHECK_FALSE(afresh.requested());
    std::signal(SIGTERM, before);
}
