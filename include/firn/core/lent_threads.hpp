/// \file Where the threads of a call come from: OpenMP's parallel region, or a host that lends threads of its own.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/team.hpp>

#include <unistd.h>

#include <functional>
#include <memory>

#ifdef _OPENMP
#include <omp.h>
#endif

namespace firn {

namespace detail {

/// A function to be run by the caller, with a team for the loops that it starts.
struct Call {
    Call(int workers, void (*function)(const void*), const void* of) : team(workers), run(function), body(of) {}

    Team team;
    void (*run)(const void* body);
    const void* body;
    const ThreadRole* const caller = &role_of_this_thread;
    bool has_run = false;
    std::exception_ptr failure = nullptr;

    void run_by_caller() {
        has_run = true;
        role_of_this_thread.team = &team;
        try {
            run(body);
        } catch (...) {
            failure = std::current_exception();
        }
        role_of_this_thread.team = nullptr;
        team.close();
    }
};

}  // namespace detail

/// What a host's threads are asked to do in one call of firn's. Copies are the same work. A copy may be called at any
/// time, also when the call is over: it then does nothing.
class Work {
public:
    explicit Work(std::shared_ptr<detail::Call> call) : call_(std::move(call)) {}

    /// Does the part of a worker. Worker 0 is the caller: it does all that no other does, and waits for chunks that
    /// others have begun, never for others to begin. Workers 1, 2, … help from when they are called to the end of the
    /// call; each may be called once, late, or not at all.
    void operator()(int worker) const noexcept {
        const std::shared_ptr<detail::Call> call = call_;
        if (worker > 0 && worker < call->team.workers())
            call->team.help(worker);
        else if (worker == 0 && call->caller == &detail::role_of_this_thread && !call->has_run)
            call->run_by_caller();
    }

private:
    std::shared_ptr<detail::Call> call_;
};

/// Lends threads to one call: work(0) on the calling thread, and work(1), …, work(workers − 1) on others, as many as
/// there are.
using Lend = std::function<void(int workers, const Work& work)>;

namespace detail {
inline constinit thread_local const Lend* lender_of_this_thread = nullptr;
}  // namespace detail

/// While it lives, loops that this thread starts run on threads that a host lends, in place of OpenMP's: each step, or
/// each stage that is called alone, asks for them once.
///
///     const firn::LentThreads lent([&](int workers, const firn::Work& work) {
///         for (int k = 1; k < workers; ++k) jobs.submit([work, k] { work(k); });  // whenever they come
///         work(0);
///     });
class LentThreads {
public:
    explicit LentThreads(Lend lend)
        : lend_(std::move(lend)), before_(std::exchange(detail::lender_of_this_thread, &lend_)) {}
    LentThreads(const LentThreads&) = delete;
    LentThreads& operator=(const LentThreads&) = delete;
    ~LentThreads() { detail::lender_of_this_thread = before_; }

private:
    Lend lend_;
    const Lend* before_;
};

namespace detail {

inline const pid_t first_process = ::getpid();

/// Whether loops that this thread starts outside any call may get helpers.
inline bool may_have_helpers() {
    if (lender_of_this_thread) return true;
#ifdef _OPENMP
    // OpenMP's threads are missing in a child of fork(): g++'s library would wait for them for ever.
    return !omp_in_parallel() && ::getpid() == first_process;
#else
    return false;
#endif
}

/// Threads that a host lends are given back after each step.
inline bool regions_span_steps() { return !lender_of_this_thread; }

/// Whether a call of this thread's may open a region now: it is not in one already.
inline bool may_open_region() {
    const ThreadRole& role = role_of_this_thread;
    return !role.team && !role.at_work && may_have_helpers();
}

/// Runs the call, and throws what it threw when no thread of another's is at work for it.
inline void run_call(const std::shared_ptr<Call>& call) {
    const Work work(call);
    if (lender_of_this_thread) {
        try {
            (*lender_of_this_thread)(call->team.workers(), work);
        } catch (...) {
            call->team.close();
            if (!call->failure) throw;
        }
    } else {
#ifdef _OPENMP
#pragma omp parallel num_threads(call->team.workers())
        work(omp_get_thread_num());
#endif
    }
    if (!call->has_run) call->run_by_caller();
    if (call->failure) std::rethrow_exception(call->failure);
}

}  // namespace detail

}  // namespace firn
