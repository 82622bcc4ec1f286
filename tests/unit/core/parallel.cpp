// part: memory
/// \file What loops over threads promise: each index once, phases in order, exceptions, and waiting that ends.
#include "support/loops.hpp"

#include <cstdlib>
#include <numeric>
#include <stdexcept>
#include <string>

using namespace firn;
using namespace loops;

TEST_CASE("A loop calls its body once for each index, with thread numbers that no two use at once",
          "[core][parallel]") {
    on_every_source([] {
        for (const int threads : {0, 1, 2, 3, many_threads})
            for (const std::size_t n : {0, 1, 2, 7, 64, 1000})
                for (const std::size_t grain : {1, 3, 64, 5000}) {
                    CAPTURE(threads, n, grain);
                    Calls calls(n, std::max(threads, 1));
                    parallel_for(n, threads, [&](std::size_t i, int thread) { calls(i, thread); }, grain);
                    CHECK(calls.each_once());
                    CHECK(calls.ids_distinct());
                    CHECK(calls.quiet());
                }
    });
}

TEST_CASE("As many threads as asked for run at once, also when they slept before", "[core][parallel]") {
    on_every_source([] {
        for (const int threads : {2, many_threads, 2, 3}) {
            sleep_ms(20);
            CAPTURE(threads);
            Meeting meeting(threads);
            Calls calls(std::size_t(threads), threads);
            std::atomic<int> met = 0;
            parallel_for(std::size_t(threads), threads, [&](std::size_t i, int thread) {
                calls.begin(i, thread);
                met += meeting.join();
                calls.end(thread);
            });
            CHECK(met == threads);
            CHECK(calls.each_once());
            CHECK(calls.ids_distinct());
        }
    });
}

TEST_CASE("A thread works through its own part of a loop, then takes what others have left from the end",
          "[core][parallel]") {
    on_every_source([] {
        // That a thread meets the same indices in every loop keeps what they stand for in its processor's cache.
        constexpr std::size_t n = 1000, middle = n / 2;
        for (const std::size_t grain : {1, 10}) {
            CAPTURE(grain);
            Meeting begun(2), left_alone(2);
            std::vector<std::size_t> of_thread[2];
            std::atomic<bool> met = true;
            parallel_for(
                n, 2,
                [&](std::size_t i, int thread) {
                    auto& mine = of_thread[thread];
                    mine.push_back(i);
                    if (mine.size() == 1 && !begun.join()) met = false;
                    if (mine.size() == (thread == 1 ? grain : n - grain) && !left_alone.join()) met = false;
                },
                grain);
            REQUIRE(met);
            std::vector<std::size_t> first, second;
            for (std::size_t i = 0; i < middle; ++i) first.push_back(i);
            for (std::size_t chunk = n - grain; chunk > middle; chunk -= grain)
                for (std::size_t i = 0; i < grain; ++i) first.push_back(chunk + i);
            for (std::size_t i = 0; i < grain; ++i) second.push_back(middle + i);
            CHECK(of_thread[0] == first);
            CHECK(of_thread[1] == second);  // it was kept in its first chunk
        }
    });
}

TEST_CASE("A loop may have more chunks than a thread's share can count", "[core][parallel]") {
    on_every_source([] {
        constexpr std::size_t n = (std::size_t(1) << 25) + 3;
        struct alignas(64) Seen {
            std::size_t count = 0, sum = 0;
        };
        std::vector<Seen> seen(3);
        parallel_for(n, 3, [&](std::size_t i, int thread) {
            ++seen[std::size_t(thread)].count;
            seen[std::size_t(thread)].sum += i;
        });
        std::size_t count = 0, sum = 0;
        for (const Seen& of_thread : seen) {
            count += of_thread.count;
            sum += of_thread.sum;
        }
        CHECK(count == n);
        CHECK(sum == n * (n - 1) / 2);
    });
}

TEST_CASE("A phase begins when all of the phase before is done, and sees what it wrote", "[core][parallel]") {
    on_every_source([] {
        const std::vector<std::size_t> counts = {100, 1, 0, 37, 100, 0, 0, 2, 1000, 0};
        for (const int threads : {1, 2, 3, many_threads})
            for (const std::size_t grain : {1, 8}) {
                CAPTURE(threads, grain);
                // Plain numbers: each call reads one of the phase before that another thread may have written.
                std::vector<std::vector<std::uint64_t>> value;
                for (const std::size_t n : counts) value.emplace_back(n, 0);
                std::vector<std::atomic<std::size_t>> done(counts.size());
                std::atomic<bool> in_order = true;
                const auto before = [&](std::size_t phase) {
                    while (phase > 0 && counts[phase - 1] == 0) --phase;
                    return phase;
                };
                const auto body = [&](std::size_t phase, std::size_t i, int) {
                    for (std::size_t p = 0; p < phase; ++p)
                        if (done[p] != counts[p]) in_order = false;
                    for (std::size_t p = phase + 1; p < counts.size(); ++p)
                        if (done[p] != 0) in_order = false;
                    const std::size_t last = before(phase);
                    value[phase][i] = last == 0 ? i : value[last - 1][(i * 7 + 3) % counts[last - 1]] + i;
                    ++done[phase];
                };
                parallel_phases(counts, threads, body, grain);
                CHECK(in_order);

                std::vector<std::uint64_t> expected;
                for (std::size_t phase = 0; phase < counts.size(); ++phase) {
                    CHECK(done[phase] == counts[phase]);
                    std::vector<std::uint64_t> now(counts[phase]);
                    for (std::size_t i = 0; i < now.size(); ++i)
                        now[i] = before(phase) == 0 ? i : expected[(i * 7 + 3) % expected.size()] + i;
                    CHECK(value[phase] == now);
                    if (!now.empty()) expected = now;
                }
            }
    });
}

TEST_CASE("A thread that sleeps for the end of a phase is woken for the next", "[core][parallel]") {
    on_every_source([] {
        for (int repeat = 0; repeat < 5; ++repeat) {
            Meeting first(2), second(2);
            std::atomic<int> met = 0;
            const std::size_t counts[] = {2, 2};
            parallel_phases(counts, 2, [&](std::size_t phase, std::size_t, int thread) {
                met += (phase == 0 ? first : second).join();
                if (phase == 0 && thread == repeat % 2) sleep_ms(20);  // meanwhile the other falls asleep
            });
            CHECK(met == 4);
        }
    });
}

TEST_CASE("An exception reaches the caller when all is quiet, and later phases do not begin", "[core][parallel]") {
    on_every_source([] {
        for (int thrower = 0; thrower < 2; ++thrower) {
            CAPTURE(thrower);
            Meeting meeting(2);
            std::atomic<int> active = 0, later = 0, after = 0;
            std::string message;
            const std::size_t counts[] = {1000, 10};
            try {
                parallel_phases(counts, 2, [&](std::size_t phase, std::size_t i, int thread) {
                    if (phase > 0) ++later;
                    if (i % 500 != 0) {  // not the first of a thread's share
                        ++after;
                        return;
                    }
                    ++active;
                    meeting.join();
                    if (thread == thrower) {
                        --active;
                        throw std::runtime_error("from thread " + std::to_string(thread));
                    }
                    sleep_ms(20);
                    --active;
                });
            } catch (const std::runtime_error& error) {
                message = error.what();
                CHECK(active == 0);
            }
            CHECK(message == "from thread " + std::to_string(thrower));
            CHECK(later == 0);
            CHECK(after == 0);  // the other thread slept while the rest was given up

            Calls calls(100, 2);
            parallel_for(100, 2, [&](std::size_t i, int thread) { calls(i, thread); });
            CHECK(calls.each_once());
        }
        // Many at once: one arrives.
        for (int repeat = 0; repeat < 100; ++repeat)
            CHECK_THROWS_AS(parallel_for(100, many_threads, [](std::size_t i, int) { throw i; }), std::size_t);
        // And alone.
        std::size_t calls = 0;
        CHECK_THROWS_AS(parallel_for(100, 1,
                                     [&](std::size_t i, int) {
                                         ++calls;
                                         if (i == 3) throw i;
                                     }),
                        std::size_t);
        CHECK(calls == 4);
    });
}

TEST_CASE("A loop inside a loop runs on the thread that calls it", "[core][parallel]") {
    on_every_source([] {
        Calls outer(20, 3);
        std::atomic<int> wrong = 0;
        parallel_for(20, 3, [&](std::size_t i, int thread) {
            outer.begin(i, thread);
            const auto self = std::this_thread::get_id();
            std::vector<int> inner(50);  // plain: only this thread touches it
            parallel_for(50, 4, [&](std::size_t k, int inner_thread) {
                wrong += self != std::this_thread::get_id() || inner_thread != 0;
                ++inner[k];
            });
            wrong += inner != std::vector<int>(50, 1);
            outer.end(thread);
        });
        CHECK(outer.each_once());
        CHECK(outer.ids_distinct());
        CHECK(wrong == 0);
    });
}

TEST_CASE("Several user threads run loops at the same time", "[core][parallel]") {
    on_every_source([] {
        std::atomic<int> wrong = 0;
        std::vector<std::thread> users;
        for (int user = 0; user < 4; ++user)
            users.emplace_back([&, user] {
                for (int repeat = 0; repeat < 300; ++repeat) {
                    const std::size_t n = std::size_t(1 + (repeat * 7 + user) % 40);
                    Calls calls(n, 2 + user);
                    parallel_for(n, 2 + user, [&](std::size_t i, int thread) { calls(i, thread); });
                    wrong += !calls.each_once() || !calls.ids_distinct() || !calls.quiet();
                }
            });
        for (std::thread& user : users) user.join();
        CHECK(wrong == 0);
    });
}

TEST_CASE("A loop that is over is left alone by threads that come late", "[core][parallel]") {
    on_every_source([] {
        // Loops so short that most threads come when theirs is over. Each has its numbers, and its body, where the one
        // before had them.
        std::uint64_t random = 1;
        int wrong = 0;
        const auto run_loops = [&](int repeats) {
            for (int repeat = 0; repeat < repeats; ++repeat) {
                random = random * 6364136223846793005u + 1442695040888963407u;
                const int threads = 2 + int(random >> 60) % 4;
                const std::size_t n = 2 + std::size_t(random >> 40) % 5, grain = 1 + std::size_t(random >> 30) % 2;
                int count[6] = {};
                if (random >> 63) {
                    parallel_for(n, threads, [&](std::size_t i, int) { ++count[i]; }, grain);
                } else {
                    const std::size_t counts[] = {n, 0, n};
                    const auto body = [&](std::size_t phase, std::size_t i, int) { count[i] += phase == 0 ? 3 : -2; };
                    parallel_phases(counts, threads, body, grain);
                }
                for (std::size_t i = 0; i < 6; ++i) wrong += count[i] != (i < n ? 1 : 0);
                if (repeat % 1000 == 0) sleep_ms(1);  // from sleep, too
            }
        };
        parallel_region(5, [&] { run_loops(30000); });
        run_loops(300);  // each in a region of its own
        CHECK(wrong == 0);
    });
}

TEST_CASE("The number of threads is the one asked for, or what is on offer", "[core][parallel]") {
    CHECK(thread_count(0) >= 1);
    CHECK(thread_count(1) == 1);
    CHECK_THROWS_AS(thread_count(-1), parameter_error);
    CHECK_THROWS_AS(thread_count(0x10000), parameter_error);
#ifdef _OPENMP
    CHECK(thread_count(7) == std::min(7, omp_get_thread_limit()));
    const int before = omp_get_max_threads();
    omp_set_num_threads(3);
    CHECK(thread_count(0) == std::min(3, omp_get_thread_limit()));
    omp_set_num_threads(before);
#else
    CHECK(thread_count(7) == 1);
#endif
    on_every_source([] {
        parallel_region(3, [] {
            CHECK(thread_count(0) == 3);
            CHECK(thread_count(2) == 2);
            CHECK(thread_count(7) == 3);
        });
        std::atomic<int> wrong = 0;
        parallel_for(2, 2, [&](std::size_t, int) { wrong += thread_count(5) != 1; });
        CHECK(wrong == 0);
    });
}

TEST_CASE("Threads without work sleep", "[core][parallel][slow]") {
    // Spinning threads would take as much CPU time as the wall time that passes, each. A quarter of it is far more than
    // a few microseconds of looking, and far less than one spinning thread takes even on a machine twice overcommitted.
    const auto taken_by = [](const auto& body) {
        const double begin = cpu_time();
        body();
        return cpu_time() - begin;
    };
    on_every_source([&] {
        sleep_ms(300);  // OpenMP's own threads wait for a region as its settings say: at most so long
        parallel_region(many_threads, [&] {
            parallel_for(100, many_threads, [](std::size_t, int) {});
            CHECK(taken_by([] { sleep_ms(400); }) < 0.1);
            for (const int sleeper : {0, 1}) {
                CAPTURE(sleeper);
                Meeting meeting(2);
                const auto sleep_in_a_chunk = [&] {
                    parallel_for(2, 2, [&](std::size_t, int thread) {
                        meeting.join();
                        if (thread == sleeper) sleep_ms(400);
                    });
                };
                CHECK(taken_by(sleep_in_a_chunk) < 0.1);
            }
        });
    });
    sleep_ms(300);
    OwnThreads threads(many_threads);
    const LentThreads lent(std::ref(threads));
    parallel_for(100, many_threads, [](std::size_t, int) {});
    CHECK(taken_by([] { sleep_ms(400); }) < 0.1);
}
