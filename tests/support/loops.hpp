/// \file What tests of loops need: threads from every source, calls that are counted, threads that must meet.
///
/// Threads that must meet wait for each other, a minute at most, so that a promise broken fails and does not hang.
#pragma once

#include "support/catch.hpp"
#include <firn/core/own_threads.hpp>
#include <firn/core/parallel.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <functional>
#include <thread>
#include <vector>

namespace loops {

#ifdef _OPENMP
inline constexpr bool with_openmp = true;
#else
inline constexpr bool with_openmp = false;
inline int omp_in_parallel() { return 0; }
#endif

/// More than this machine has, so that threads must take turns.
inline const int many_threads = 2 * int(std::max(2u, std::thread::hardware_concurrency())) + 1;

/// Runs a test on OpenMP's threads, where it is compiled with OpenMP, and on threads that are lent.
template <class Test>
void on_every_source(const Test& test) {
    if (with_openmp) {
        INFO("OpenMP's threads");
        test();
    }
    INFO("threads of firn's own");
    firn::OwnThreads threads(many_threads);
    const firn::LentThreads lent(std::ref(threads));
    test();
}

/// Holds each thread that comes until `count` have come: then that many run at once.
class Meeting {
public:
    explicit Meeting(int count) : missing_(count) {}
    bool join() {
        --missing_;
        const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
        while (missing_ > 0) {
            if (std::chrono::steady_clock::now() > end) return false;
            std::this_thread::sleep_for(std::chrono::microseconds(100));
        }
        return true;
    }

private:
    std::atomic<int> missing_;
};

/// Notes calls of a loop from many threads.
class Calls {
public:
    Calls(std::size_t n, int threads) : count_(n), active_(std::size_t(threads)) {}

    void begin(std::size_t i, int thread) {
        ++count_.at(i);
        if (active_.at(std::size_t(thread))++ != 0) wrong_ = true;
    }
    void end(int thread) { --active_[std::size_t(thread)]; }
    void operator()(std::size_t i, int thread) {
        begin(i, thread);
        end(thread);
    }
    bool each_once() const {
        return std::all_of(count_.begin(), count_.end(), [](const auto& c) { return c == 1; });
    }
    bool ids_distinct() const { return !wrong_; }
    bool quiet() const {
        return std::all_of(active_.begin(), active_.end(), [](const auto& a) { return a == 0; });
    }

private:
    std::vector<std::atomic<int>> count_, active_;
    std::atomic<bool> wrong_ = false;
};

/// CPU time of all threads of this process [s].
inline double cpu_time() { return double(std::clock()) / CLOCKS_PER_SEC; }

inline void sleep_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

}  // namespace loops
