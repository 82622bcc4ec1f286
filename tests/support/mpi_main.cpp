// The main program of tests on several ranks. Rank 0 prints what Catch2 says. The first check that fails on any rank is
// printed with the number of the rank, and ends all ranks, as the others may wait for this one for ever.
#define CATCH_CONFIG_RUNNER
#define CATCH_CONFIG_NO_POSIX_SIGNALS  // a rank that is ended because another failed has nothing to say
#include <firn/mpi/session.hpp>
#include <support/catch.hpp>

#include <iostream>
#include <sstream>

namespace {

#if __has_include(<catch2/catch_all.hpp>)
using Listener = Catch::EventListenerBase;
using Ended = void;
#else
using Listener = Catch::TestEventListenerBase;
using Ended = bool;
#endif

struct FailureEndsAll : Listener {
    using Listener::Listener;

    void testCaseStarting(const Catch::TestCaseInfo& test) override { name_ = test.name; }

    Ended assertionEnded(const Catch::AssertionStats& stats) override {
        const auto& result = stats.assertionResult;
        if (!result.isOk()) {
            std::ostringstream text;
            text << name_ << "\n" << result.getSourceInfo() << ": failed";
            if (result.hasExpression()) text << "\n    " << result.getExpressionInMacro();
            if (result.hasExpandedExpression()) text << "\nas\n    " << result.getExpandedExpression();
            for (const auto& info : stats.infoMessages) text << "\n" << info.message;
            if (result.hasMessage()) text << "\n" << result.getMessage();
            std::cout.flush();
            firn::mpi::Session::fail(text.str());
        }
        return Ended(true);
    }

private:
    std::string name_;
};
CATCH_REGISTER_LISTENER(FailureEndsAll)

}  // namespace

int main(int argc, char** argv) {
    firn::mpi::Session session(argc, argv);
    const firn::mpi::Communicator ranks;
    std::ostringstream silenced;
    std::streambuf* const loud = std::cout.rdbuf();
    if (ranks.rank() > 0) std::cout.rdbuf(silenced.rdbuf());
    const int failed = Catch::Session().run(argc, argv);
    std::cout.rdbuf(loud);
    return ranks.max(failed);
}
