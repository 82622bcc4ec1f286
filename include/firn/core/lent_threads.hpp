/// \file The threads on which a call of firn runs: those of OpenMP, or threads that the calling program (the host)
/// lends.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/team.hpp>

#include <functional>

#ifdef _OPENMP
#include <omp.h>
#include <unistd.h>
#endif

namespace firn::inline FIRN_BUILD {

namespace detail {

/// One call of firn: the function that the calling thread runs, and the team of workers for the loops that the function
/// starts.
struct Call {
    Call(int workers, void (*function)(const void*), const void* of) : team(workers), run(function), body(of) {}

    Team team;
    void (*run)(const void* body);
    const void* body;
    const ThreadRole* const caller = &role_of_this_thread;
    bool has_run = false;
    std::exception_ptr failure = nullptr;
    std::atomic<int> holders = 0;  ///< number of CallHolders that refer to this call

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

/// Refers to a Call, as a std::shared_ptr does: the last holder deletes the call. A std::shared_ptr is not used, since
/// a standard library without threads (WebAssembly) counts its references without atomic operations.
class CallHolder {
public:
    explicit CallHolder(Call* call) : call_(call) { ++call->holders; }
    CallHolder(const CallHolder& other) : CallHolder(other.call_) {}
    CallHolder(CallHolder&& other) noexcept : call_(std::exchange(other.call_, nullptr)) {}
    CallHolder& operator=(CallHolder other) noexcept {
        std::swap(call_, other.call_);
        return *this;
    }
    ~CallHolder() {
        if (call_ && --call_->holders == 0) delete call_;
    }
    Call* operator->() const { return call_; }

private:
    Call* call_;
};

}  // namespace detail

/// The work of one call of firn, to be run on the host's threads. Copies of a Work refer to the same call. A Work may
/// be invoked at any time. If it is invoked after the call has ended, it does nothing.
class Work {
public:
    /// This constructor is for firn only. firn makes one Work per call.
    explicit Work(detail::CallHolder call) : call_(std::move(call)) {}

    /// Runs the call's work as the worker with index `worker`.
    ///
    /// work(0) must be invoked on the thread that started the call. work(0) runs all chunks that no other worker runs,
    /// and waits only for chunks that other workers have started.
    ///
    /// work(1), work(2), … help until the call ends. Each of them may be invoked at any time or not at all, but only
    /// once.
    void operator()(int worker) const noexcept {
        const detail::CallHolder call = call_;
        if (worker > 0 && worker < call->team.workers())
            call->team.help(worker);
        else if (worker == 0 && call->caller == &detail::role_of_this_thread && !call->has_run)
            call->run_by_caller();
    }

private:
    detail::CallHolder call_;
};

/// A function of the host that lends threads to one call of firn. The function must invoke work(0) on the thread on
/// which the function itself was called. It should also invoke work(1), …, work(workers − 1) on other threads, or only
/// some of these if the host has fewer threads.
using Lend = std::function<void(int workers, const Work& work)>;

namespace detail {
inline constinit thread_local const Lend* lender_of_this_thread = nullptr;
}  // namespace detail

/// Lends threads of the host (the calling program) to firn. An object of this class acts on the thread that made it.
/// While the object lives, all loops that this thread starts run on the host's threads instead of OpenMP's threads.
/// firn asks the host for threads once per step, and once per stage that is called alone.
///
///     const firn::LentThreads lent([&](int workers, const firn::Work& work) {
///         for (int k = 1; k < workers; ++k) jobs.submit([work, k] { work(k); });  // may run late
///         work(0);
///     });
class [[nodiscard]] LentThreads {
public:
    /// Makes the calling thread's loops run on threads that `lend` provides, as long as this object lives.
    /// \param lend  called once for each step or stage, on the thread that starts the step or stage
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

#ifdef _OPENMP
inline const pid_t first_process = ::getpid();
#endif

/// Whether loops may get helpers (other threads) if this thread starts them while it is not inside a call of firn.
inline bool may_have_helpers() {
    if (lender_of_this_thread) return true;
#ifdef _OPENMP
    // In a child process after fork(), OpenMP's threads do not exist. g++'s OpenMP library would wait for them for
    // ever.
    return !omp_in_parallel() && ::getpid() == first_process;
#else
    return false;
#endif
}

/// Whether several steps may run in one parallel region. This is false if the host lends the threads, because the host
/// gets its threads back after each step.
inline bool regions_span_steps() { return !lender_of_this_thread; }

/// Whether this thread may open a parallel region: it may have helpers (other threads), and it is not already working
/// in a region.
inline bool may_open_region() {
    const ThreadRole& role = role_of_this_thread;
    return !role.team && !role.at_work && may_have_helpers();
}

/// Runs a call of firn. If the call's function throws, run_call() rethrows the exception as soon as no helper runs a
/// chunk any more.
inline void run_call(const CallHolder& call) {
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

}  // namespace firn::inline FIRN_BUILD
