/// \file What OpenMP's settings do, one process for each: how many workers there are, where they may run, and that a
/// run has the same bits. arguments: KEY=NUMBER …, see main().
#include "support/scenes.hpp"
#include <firn/core/own_threads.hpp>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <set>
#include <string>

using namespace firn;

namespace {

/// The processors that a thread may run on.
std::set<int> own_processors() {
    std::set<int> processors;
#ifdef __linux__
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        for (int k = 0; k < CPU_SETSIZE; ++k)
            if (CPU_ISSET(k, &set)) processors.insert(k);
#endif
    return processors;
}

/// The workers of a loop of which each holds its chunk until all have theirs, or for a second.
std::map<int, std::set<int>> workers_of_loop(int workers) {
    std::map<int, std::set<int>> seen;
    std::mutex mutex;
    std::atomic<int> here = 0;
    parallel_for(std::size_t(workers), workers, [&](std::size_t, int worker) {
        {
            const std::lock_guard lock(mutex);
            seen[worker] = own_processors();
        }
        ++here;
        for (int waited = 0; here < workers && waited < 1000; ++waited)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
    return seen;
}

std::uint64_t hash_of_run(int threads) {
    const auto jelly = FixedCorotated<float>::from_young_poisson(1e5, 0.3);
    Simulation<2> simulation({{0.0, 0.0}, {1.0, 1.0}, 1.0 / 64}, jelly, {threads});
    scenes::add_two_blocks<2>(simulation, 0.3, 1.0 / 256);
    simulation.step();
    simulation.advance(0.02);
    return scenes::hash(simulation);
}

int failures = 0;

void check(bool right, const std::string& what) {
    std::printf("%s: %s\n", right ? "ok" : "FAILED", what.c_str());
    failures += !right;
}

void check_one_processor_each(const std::map<int, std::set<int>>& workers, const char* whose) {
    std::set<std::set<int>> places;
    for (const auto& [worker, processors] : workers) {
        check(processors.size() == 1, std::string(whose) + ": a worker is bound to one processor");
        places.insert(processors);
    }
    check(places.size() == workers.size(), std::string(whose) + ": no two to the same");
}

}  // namespace

/// asked: of thread_count(); counted: what it says; workers: those that come, or with fewer=1, at most those;
/// bound: 1 where each has a processor of its own, 0 where each has those of the process.
/// \return 77 where this machine has too few processors to tell
int main(int count, char** arguments) {
    std::map<std::string, int> given;
    for (int i = 1; i < count; ++i) {
        const std::string argument = arguments[i];
        const std::size_t equals = argument.find('=');
        given[argument.substr(0, equals)] = std::atoi(argument.c_str() + equals + 1);
    }
    if (given["bound"] && std::thread::hardware_concurrency() < 2) return 77;
    const int asked = given["asked"], workers = given["workers"];
    const std::set<int> of_process = own_processors();
    check(thread_count(asked) == given["counted"],
          sentence("thread_count(", asked, ") is ", thread_count(asked), ", expected ", given["counted"]));
    const auto seen = workers_of_loop(thread_count(asked));
    check(given["fewer"] ? int(seen.size()) <= workers : int(seen.size()) == workers,
          sentence(seen.size(), " workers came, expected ", workers));
    if (given.contains("bound")) {
        OwnThreads threads(2);
        const LentThreads lent(std::ref(threads));
        if (given["bound"]) {
            check_one_processor_each(seen, "OpenMP's threads");
            check_one_processor_each(workers_of_loop(2), "firn's own");
        } else {
            for (const auto& [worker, processors] : workers_of_loop(2))
                check(processors == of_process, "firn's own are not bound");
        }
    }
    const std::uint64_t alone = hash_of_run(1);
    for (const int threads : {asked, 2, 3}) check(hash_of_run(threads) == alone, "the same bits as on one thread");
    return failures == 0 ? 0 : 1;
}
