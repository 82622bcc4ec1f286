/// \file Steps go without helpers while those would only hold them up, and have them again when they are of use.
#include "support/loops.hpp"
#include <firn/core/step_region.hpp>

using namespace firn;
using namespace loops;

namespace {

/// A machine on which steps are taken, in seconds that are counted, not waited for.
struct Machine {
    double alone;  ///< of a step without helpers
    double loops;  ///< of its loops with helpers
    double late;   ///< by which the region of every `each`-th step with helpers takes longer
    int each = 1;
    int regions = 0;

    double step(detail::StepHelpers& helpers) {
        const bool wanted = helpers.are_wanted();
        regions += wanted;
        const double body = wanted ? loops : alone;
        const double whole = body + (wanted ? regions % each == 0 ? late : 2e-6 : 0);
        helpers.took(whole, body);
        return whole;
    }
    double steps(detail::StepHelpers& helpers, int count) {
        double sum = 0;
        for (int i = 0; i < count; ++i) sum += step(helpers);
        return sum;
    }
};

constexpr int count = 10000;

}  // namespace

TEST_CASE("Where helpers are in time, all steps have them", "[core][region]") {
    Machine machine{.alone = 330e-6, .loops = 200e-6, .late = 2e-6};
    detail::StepHelpers helpers;
    machine.steps(helpers, count);
    CHECK(machine.regions == count);
}

TEST_CASE("Where another program holds helpers up, steps take little longer than without helpers", "[core][region]") {
    // 8,000 particles on two threads, a processor of which is held: a region waits 3 ms for its end.
    for (const int each : {1, 2, 5, 20}) {
        CAPTURE(each);
        Machine machine{.alone = 330e-6, .loops = 300e-6, .late = 3e-3, .each = each};
        detail::StepHelpers helpers;
        CHECK(machine.steps(helpers, count) < 1.15 * count * machine.alone);
        CHECK(machine.regions > 10);  // it tries now and then

        machine.late = 2e-6;  // the other program has ended
        machine.steps(helpers, 1000);
        machine.regions = 0;
        machine.steps(helpers, 100);
        CHECK(machine.regions == 100);
    }
}

TEST_CASE("Where helpers come late, but steps are shorter for them all the same, they have them", "[core][region]") {
    Machine machine{.alone = 100e-3, .loops = 2e-3, .late = 3e-3};  // some sixty threads
    detail::StepHelpers helpers;
    machine.steps(helpers, count);
    CHECK(machine.regions >= count * 99 / 100);
}

TEST_CASE("A step without helpers runs its loops on the calling thread", "[core][region]") {
    on_every_source([] {
        detail::StepHelpers helpers;
        while (helpers.are_wanted()) helpers.took(1, 0.1);
        std::atomic<int> wrong = 0;
        const auto caller = std::this_thread::get_id();
        detail::steps_region(3, true, helpers, [&] {
            CHECK(thread_count(3) == 1);
            parallel_for(
                100, 3, [&](std::size_t, int worker) { wrong += worker != 0 || std::this_thread::get_id() != caller; });
        });
        CHECK(wrong == 0);
        CHECK(thread_count(3) == 3);
    });
}
