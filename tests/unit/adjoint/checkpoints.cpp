/// \file Checkpoints: no step is taken again more often than the binomial bound says.
#include "support/bring_state.hpp"
#include "support/catch.hpp"
#include <firn/adjoint/checkpoints.hpp>

#include <numeric>

using firn::Checkpoints;
using test_support::bring_state;

namespace checkpoint_tests {
namespace {

/// How often each step is taken again on the way back through `steps` steps; every state is the right one.
std::vector<int> repetitions(std::size_t steps, std::size_t most) {
    Checkpoints<std::size_t> kept(most);
    std::size_t now = 0;  // the state of the run
    const auto store = [&](std::size_t& to) { to = now; };
    kept.keep(0, store);
    while (now < steps) kept.keep(++now, store);
    kept.finish(store);
    std::vector<int> again(steps);
    for (std::size_t wanted = steps; wanted-- > 0;) {
        kept.forget_behind(wanted);
        bring_state(
            kept, now, wanted, [](std::size_t state) { return state; }, store, [&](std::size_t k) { ++again[k]; });
    }
    return again;
}

/// The least r with C(s + r, s) ≥ N.
int bound(std::size_t steps, std::size_t most) {
    double ways = 1;
    int r = 0;
    while (ways < double(steps)) ++r, ways = ways * double(most + std::size_t(r)) / r;
    return r;
}

}  // namespace

TEST_CASE("with s checkpoints, no step of C(s + r, s) is taken again more than r times", "[adjoint]") {
    for (const std::size_t most : {2, 3, 4, 5, 7, 9, 10, 11, 16, 20, 39, 56, 100})
        for (const std::size_t steps : {1, 2, 3, 5, 10, 31, 100, 121, 300, 500, 624, 1500, 2000, 20000}) {
            if (most < 5 && steps > 2000) continue;  // hundreds of times
            const std::vector<int> again = repetitions(steps, most);
            CAPTURE(most, steps);
            CHECK(*std::max_element(again.begin(), again.end()) <= bound(steps, most));
        }
    // 500 steps with 56 checkpoints, one GiB of 144,054 particles: less than one more step a step.
    const std::vector<int> again = repetitions(500, 56);
    CHECK(std::accumulate(again.begin(), again.end(), 0) < 500);
}

namespace {
/// A state that counts those in memory.
struct Counted {
    static inline std::size_t all = 0;
    std::size_t index = 0;
    Counted() { ++all; }
    ~Counted() { --all; }
    Counted(const Counted&) = delete;
};
}  // namespace

TEST_CASE("where states grow, fewer are in memory, and all can be brought back", "[adjoint]") {
    for (const std::size_t most : {3, 4, 7, 19, 20, 23, 40, 100})
        for (const std::size_t fewer : {2, 3, 5, 16, 21, 60})
            for (const std::size_t steps : {1, 7, 30, 64, 333}) {
                CAPTURE(most, fewer, steps);
                Checkpoints<Counted> kept(most);
                std::size_t now = 0;
                const auto store = [&](Counted& to) { to.index = now; };
                kept.keep(0, store);
                while (now < steps) {
                    ++now;
                    if (now >= steps / 2 && kept.most() > std::min(most, fewer)) {
                        kept.lower_most(kept.most() - 1);
                        REQUIRE(Counted::all <= kept.most());
                    }
                    kept.keep(now, store);
                    REQUIRE(Counted::all <= kept.most());
                }
                kept.finish(store);
                for (std::size_t wanted = steps; wanted-- > 0;) {
                    kept.forget_behind(wanted);
                    bring_state(
                        kept, now, wanted, [](const Counted& state) { return state.index; }, store, [](std::size_t) {});
                    REQUIRE(Counted::all <= kept.most());
                }
            }
}

}  // namespace checkpoint_tests
