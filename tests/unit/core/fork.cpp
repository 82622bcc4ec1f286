/// \file A child of fork(): its loops run, on the calling thread, and end.
#include "support/loops.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

using namespace firn;
using namespace loops;

#if !defined(FIRN_SANITIZED)  // ThreadSanitizer allows no threads in a forked child

namespace {

/// What a child that runs `body` exits with; −1 if it does not within 20 s: g++'s OpenMP would hang there for ever.
template <class Body>
int exit_of_child(const Body& body) {
    const pid_t child = ::fork();
    if (child == 0) std::_Exit(body());
    int status = 0;
    for (int waited = 0; ::waitpid(child, &status, WNOHANG) == 0; ++waited) {
        if (waited < 2000) {
            sleep_ms(10);
            continue;
        }
        ::kill(child, SIGKILL);
        ::waitpid(child, &status, 0);
        return -1;
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// How many workers took part in a loop of which each holds its chunk for a while.
int workers_of_loop(int workers) {
    std::vector<int> seen;
    std::mutex mutex;
    parallel_for(std::size_t(workers), workers, [&](std::size_t, int worker) {
        {
            const std::lock_guard lock(mutex);
            seen.push_back(worker);
        }
        sleep_ms(20);
    });
    std::sort(seen.begin(), seen.end());
    return int(std::unique(seen.begin(), seen.end()) - seen.begin());
}

}  // namespace

TEST_CASE("A child of fork() runs its loops on the calling thread, and its parent goes on as before", "[core][fork]") {
    const int before = workers_of_loop(2);
    CHECK(before == (with_openmp ? 2 : 1));
    CHECK(exit_of_child([] { return thread_count(5) == 1 && workers_of_loop(3) == 1 ? 0 : 1; }) == 0);
    CHECK(workers_of_loop(2) == before);
}

TEST_CASE("A pool of the parent's lends nothing to a child of fork(), one of its own does", "[core][fork]") {
    OwnThreads threads(2);
    const LentThreads lent(std::ref(threads));
    CHECK(workers_of_loop(2) == 2);
    CHECK(exit_of_child([&] {
              if (threads.workers() != 1 || workers_of_loop(2) != 1) return 1;
              OwnThreads of_child(2);
              const LentThreads lent_by_child(std::ref(of_child));
              return workers_of_loop(2) == 2 ? 0 : 2;
          }) == 0);
    CHECK(workers_of_loop(2) == 2);
}

TEST_CASE("A pool of the parent's may be destroyed in a child of fork()", "[core][fork]") {
    OwnThreads threads(3);
    CHECK(exit_of_child([&] {
              threads.~OwnThreads();
              return 0;
          }) == 0);
}

#endif
