// part: memory
/// \file Where threads come from: one region for a call, regions of users, threads that a host lends.
#include "support/loops.hpp"

#include <stdexcept>
#include <string>
#include <utility>

using namespace firn;
using namespace loops;

namespace {

/// So many workers are at work at once in a loop of the calling thread's.
bool work_together(int workers) {
    Meeting meeting(workers);
    std::atomic<int> met = 0;
    parallel_for(std::size_t(workers), workers, [&](std::size_t, int) { met += meeting.join(); });
    return met == workers;
}

/// What n calls gave, each once.
void check_loop(int workers) {
    Calls calls(1000, workers);
    parallel_for(1000, workers, [&](std::size_t i, int worker) { calls(i, worker); }, 3);
    CHECK(calls.each_once());
    CHECK(calls.ids_distinct());
}

}  // namespace

TEST_CASE("The loops of a region share their workers, and serial code between them is the caller's", "[core][region]") {
    on_every_source([] {
        const auto caller = std::this_thread::get_id();
        std::vector<std::thread::id> first(3), second(3);
        const auto note = [](std::vector<std::thread::id>& ids) {
            Meeting meeting(3);
            parallel_for(3, 3, [&](std::size_t, int worker) {
                ids[std::size_t(worker)] = std::this_thread::get_id();
                meeting.join();
            });
        };
        parallel_region(3, [&] {
            note(first);
            CHECK(std::this_thread::get_id() == caller);
            parallel_region(2, [&] { note(second); });  // part of it
        });
        CHECK(first == second);
        CHECK(first[0] == caller);
        CHECK(work_together(2));  // the region is over
    });
}

TEST_CASE("A region is closed when it is left by an exception, and when what it runs throws", "[core][region]") {
    on_every_source([] {
        for (const bool in_a_chunk : {false, true}) {
            std::string message;
            try {
                parallel_region(2, [&] {
                    if (in_a_chunk) parallel_for(100, 2, [](std::size_t, int) { throw std::runtime_error("stop"); });
                    throw std::runtime_error("stop");
                });
            } catch (const std::runtime_error& error) {
                message = error.what();
                CHECK(omp_in_parallel() == 0);
                CHECK(work_together(2));  // in the handler, too
            }
            CHECK(message == "stop");
        }
    });
}

TEST_CASE("Threads of the user's with loops of their own do not wait for one another", "[core][region]") {
    // Each holds its two workers until the others hold theirs.
    on_every_source([] {
        Meeting all(3 * 2);
        std::atomic<int> met = 0;
        const auto user = [&] { parallel_for(2, 2, [&](std::size_t, int) { met += all.join(); }); };
        std::vector<std::thread> users;
        for (int k = 0; k < 3; ++k)
            users.emplace_back([&] {
                OwnThreads threads(with_openmp ? 1 : 2);
                if (with_openmp) return user();
                const LentThreads lent(std::ref(threads));
                user();
            });
        for (std::thread& thread : users) thread.join();
        CHECK(met == 3 * 2);
    });
}

#ifdef _OPENMP
TEST_CASE("Inside a parallel region of the user's a loop runs on the calling thread", "[core][region]") {
    std::atomic<int> wrong = 0, inside = 0;
#pragma omp parallel num_threads(2)
    {
        const auto self = std::this_thread::get_id();
        wrong += omp_in_parallel() && thread_count(5) != 1;
        if (omp_in_parallel())
            parallel_for(50, 4, [&](std::size_t, int worker) {
                ++inside;
                wrong += self != std::this_thread::get_id() || worker != 0;
            });
    }
    CHECK(wrong == 0);
    CHECK((inside == 100 || omp_get_thread_limit() == 1));
}

TEST_CASE("A user's own region has its threads between calls, and after one", "[core][region]") {
    const auto count = [] {
        std::atomic<int> threads = 0;
#pragma omp parallel num_threads(3)
        ++threads;
        return int(threads);
    };
    const int before = count();
    check_loop(2);
    CHECK(count() == before);
    CHECK_THROWS_AS(parallel_for(10, 2, [](std::size_t i, int) { throw i; }), std::size_t);
    CHECK(count() == before);
}
#endif

TEST_CASE("Helpers may come late, never, twice, or when the call is over", "[core][lent]") {
    const int workers = 4;
    const auto check_lender = [&](const Lend& lend) {
        const LentThreads lent(lend);
        check_loop(workers);
        parallel_region(workers, [&] {
            for (int repeat = 0; repeat < 3; ++repeat) check_loop(workers);
        });
    };
    SECTION("never") {
        check_lender([](int, const Work& work) { work(0); });
    }
    SECTION("not even the caller is asked to work") {
        check_lender([](int, const Work&) {});
    }
    SECTION("one after another on the calling thread, when the work is done") {
        check_lender([](int of, const Work& work) {
            for (int k = 0; k < of; ++k) work(k);
        });
    }
    SECTION("the last first, each at a time of its own") {
        check_lender([](int of, const Work& work) {
            std::vector<std::jthread> helpers;
            for (int k = of - 1; k > 0; --k)
                helpers.emplace_back([&work, k] {
                    std::this_thread::sleep_for(std::chrono::microseconds(50 * k));
                    work(k);
                });
            work(0);
        });
    }
    SECTION("twice, and such as there are none") {
        check_lender([](int of, const Work& work) {
            std::vector<std::jthread> helpers;
            for (int k = 1; k < 3 * of; ++k) helpers.emplace_back(work, k % of);
            for (const int none : {-1, of, of + 7}) work(none);
            work(0);
            work(0);
        });
    }
    SECTION("when the call is over") {
        std::vector<Work> kept;
        check_lender([&](int, const Work& work) {
            work(0);
            kept.push_back(work);
        });
        for (const Work& work : kept)
            for (int k = 0; k < workers; ++k) work(k);
    }
    SECTION("from a thread that is not the caller's, as worker 0") {
        check_lender([](int, const Work& work) { std::jthread(work, 0).join(); });
    }
}

TEST_CASE("What a lender throws reaches the caller, and what the loop throws goes before it", "[core][lent]") {
    struct NoThreads {};
    int calls = 0;
    {
        const LentThreads lent([](int, const Work&) { throw NoThreads(); });
        CHECK_THROWS_AS(parallel_for(100, 2, [&](std::size_t, int) { ++calls; }), NoThreads);
    }
    CHECK(calls == 0);
    const LentThreads lent([](int, const Work& work) {
        work(0);
        throw NoThreads();
    });
    CHECK_THROWS_AS(parallel_for(100, 2, [&](std::size_t, int) { ++calls; }), NoThreads);
    CHECK(calls == 100);
    CHECK_THROWS_AS(parallel_for(100, 2, [](std::size_t i, int) { throw i; }), std::size_t);
}

TEST_CASE("Threads are lent to the loops of one thread, for as long as it says so", "[core][lent]") {
    int lends = 0;
    const auto count = [&](int, const Work& work) {
        ++lends;
        work(0);
    };
    {
        const LentThreads lent(count);
        check_loop(2);
        CHECK(lends == 1);
        parallel_region(2, [] { check_loop(2), check_loop(2); });
        CHECK(lends == 2);
        std::thread([] { check_loop(2); }).join();
        CHECK(lends == 2);
        int others = 0;
        {
            const LentThreads by_another([&](int, const Work& work) { ++others, work(0); });
            check_loop(2);
        }
        CHECK(others == 1);
        check_loop(2);
        CHECK(lends == 3);
    }
    check_loop(2);
    CHECK(lends == 3);
}
