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
    double late;   ///< by which every `each`-th region takes longer
    int each = 1;
    std::uint64_t most = 1;  ///< steps that a region may have
    int regions = 0;
    std::uint64_t helped = 0;  ///< steps that had helpers

    double steps(detail::StepHelpers& helpers, std::uint64_t count) {
        double sum = 0;
        for (std::uint64_t taken = 0, now = 0; taken < count; taken += now) {
            now = std::min(most, count - taken);
            if (const std::uint64_t without = helpers.steps_alone(); without > 0) {
                now = std::min(now, without);
                helpers.took(double(now) * alone, double(now) * alone, now);
                sum += double(now) * alone;
                continue;
            }
            ++regions;
            helped += now;
            const double body = double(now) * loops, whole = body + (regions % each == 0 ? late : 2e-6);
            helpers.took(whole, body, now);
            sum += whole;
        }
        return sum;
    }
};

constexpr std::uint64_t count = 10000;

}  // namespace

TEST_CASE("Where helpers are in time, all steps have them", "[core][region]") {
    Machine machine{.alone = 330e-6, .loops = 200e-6, .late = 2e-6};
    detail::StepHelpers helpers;
    machine.steps(helpers, count);
    CHECK(machine.helped == count);
}

TEST_CASE("Where another program holds helpers up, steps take little longer than without helpers", "[core][region]") {
    // 8,000 particles on two threads, a processor of which is held: a region waits 3 ms for its end.
    const auto [each, most] = GENERATE(std::pair{1, 1}, std::pair{2, 1}, std::pair{5, 1}, std::pair{20, 1},
                                       std::pair{1, 10}, std::pair{3, 10}, std::pair{1, 40});
    CAPTURE(each, most);
    Machine machine{.alone = 330e-6, .loops = 300e-6, .late = 3e-3, .each = each, .most = std::uint64_t(most)};
    detail::StepHelpers helpers;
    CHECK(machine.steps(helpers, count) < 1.15 * count * machine.alone);
    CHECK(machine.regions > 10);  // it tries now and then

    machine.late = 2e-6;  // the other program has ended
    machine.steps(helpers, 1000);
    machine.helped = 0;
    machine.steps(helpers, 100);
    CHECK(machine.helped == 100);
}

TEST_CASE("Where helpers come late, but steps are shorter for them all the same, they have them", "[core][region]") {
    Machine machine{.alone = 100e-3, .loops = 2e-3, .late = 3e-3};  // some sixty threads
    detail::StepHelpers helpers;
    machine.steps(helpers, count);
    CHECK(machine.helped >= count * 99 / 100);
}

TEST_CASE("A step without helpers runs its loops on the calling thread", "[core][region]") {
    on_every_source([] {
        detail::StepHelpers helpers;
        while (helpers.steps_alone() == 0) helpers.took(1, 0.1, 1);
        std::atomic<int> wrong = 0;
        const auto caller = std::this_thread::get_id();
        detail::steps_region(3, 1, helpers, [&](std::uint64_t steps) {
            CHECK(thread_count(3) == 1);
            parallel_for(
                100, 3, [&](std::size_t, int worker) { wrong += worker != 0 || std::this_thread::get_id() != caller; });
            return steps;
        });
        CHECK(wrong == 0);
        CHECK(thread_count(3) == 3);
    });
}
