/// \file Where the threads of a call come from: OpenMP's parallel region, or a host that lends its own threads.
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

/// A function that the caller runs, with a team for the loops that the function starts.
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

/// The work of one call, to be run on a host's threads. Copies refer to the same work. A copy may be called at any
/// time; after the end of the call it does nothing.
class Work {
public:
    /// Used by firn, which creates the work of a call.
    explicit Work(std::shared_ptr<detail::Call> call) : call_(std::move(call)) {}

    /// Runs the part of one worker.
    ///
    /// Worker 0 must run on the thread that started the call. It runs everything that no other worker runs; it waits
    /// only for chunks that others have started.
    ///
    /// Workers 1, 2, … help until the call ends. Each may be called once, late, or not at all.
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

/// A function that lends threads to one call. It runs work(0) on the calling thread, and work(1), …, work(workers − 1)
/// on other threads, as many as it has.
using Lend = std::function<void(int workers, const Work& work)>;

namespace detail {
inline constinit thread_local const Lend* lender_of_this_thread = nullptr;
}  // namespace detail

/// While an object of this class lives, loops that its thread starts run on a host's threads instead of OpenMP's. Each
/// step, and each stage that is called alone, asks for threads once.
///
///     const firn::LentThreads lent([&](int workers, const firn::Work& work) {
///         for (int k = 1; k < workers; ++k) jobs.submit([work, k] { work(k); });  // may run late
///         work(0);
///     });
class LentThreads {
public:
    /// \param lend  called for each step or stage, on the thread that starts it
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

/// Whether loops may get helpers if this thread starts them outside of a call.
inline bool may_have_helpers() {
    if (lender_of_this_thread) return true;
#ifdef _OPENMP
    // OpenMP's threads do not exist in a child of fork(). g++'s library would wait for them for ever.
    return !omp_in_parallel() && ::getpid() == first_process;
#else
    return false;
#endif
}

/// Whether one region may hold several steps. A host gets its threads back after each step.
inline bool regions_span_steps() { return !lender_of_this_thread; }

/// Whether this thread may open a region: it may have helpers and is not inside a region.
inline bool may_open_region() {
    const ThreadRole& role = role_of_this_thread;
    return !role.team && !role.at_work && may_have_helpers();
}

/// Runs the call. Rethrows its exception when no helper runs a chunk any more.
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
