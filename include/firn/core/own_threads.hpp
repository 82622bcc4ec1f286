/// \file A pool of threads for firn's loops, for programs without OpenMP and for a child process after fork().
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/parallel.hpp>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#ifdef __linux__
#include <sched.h>
#endif

namespace firn::inline FIRN_BUILD {

/// A pool of threads. The threads sleep while no loop of firn runs, and end when the pool is destroyed.
///
///     firn::OwnThreads threads;
///     const firn::LentThreads lent(std::ref(threads));  // this thread's loops use the pool from here on
///
/// On Linux, if firn is compiled with OpenMP, the threads are bound to processors as OpenMP's settings say
/// (OMP_PROC_BIND, OMP_PLACES). Otherwise the threads are not bound.
class OwnThreads {
public:
    /// Starts the threads. If the system cannot start that many threads, the pool has fewer.
    /// \param workers  number of workers, including the calling thread; 0: the number of processors of the machine
    explicit OwnThreads(int workers = 0) : pool_(new Pool) {
        const int wanted = workers > 0 ? workers : int(std::thread::hardware_concurrency());
        try {
            for (int k = 1; k < wanted; ++k)
                pool_->threads.emplace_back([pool = pool_, k, wanted] {
                    bind(k, wanted);
                    pool->serve();
                });
        } catch (const std::system_error&) {
        }
    }
    OwnThreads(const OwnThreads&) = delete;
    OwnThreads& operator=(const OwnThreads&) = delete;
    /// Ends the threads. In a child process after fork() the destructor does nothing, since the threads do not exist
    /// there. The pool's memory is then not freed: threads of the parent process wait on the pool's condition variable,
    /// so this variable cannot be destroyed.
    ~OwnThreads() {
        if (is_of_parent()) return;
        pool_->end();
        delete pool_;
    }

    /// Number of workers, including the calling thread; 1 in a child process after fork().
    int workers() const { return is_of_parent() ? 1 : int(pool_->threads.size()) + 1; }

    /// Runs the work on the calling thread and on threads of the pool, on at most `workers` threads in all. \see Lend
    void operator()(int workers, const Work& work) {
        const int helpers = std::min(workers, this->workers()) - 1;
        if (helpers > 0) pool_->post(work, helpers);
        work(0);
    }

private:
    struct Job {
        Work work;
        int worker;
    };
    struct Pool {
        std::mutex mutex;
        std::condition_variable wanted;
        std::deque<Job> jobs;
        std::atomic<std::uint64_t> posted = 0, taken = 0;  // numbers of jobs posted and taken so far
        bool is_over = false;
        std::vector<std::thread> threads;

        void post(const Work& work, int helpers) {
            {
                const std::lock_guard lock(mutex);
                for (int k = 1; k <= helpers; ++k) jobs.push_back({work, k});
                posted += std::uint64_t(helpers);
            }
            if (helpers == 1)
                wanted.notify_one();
            else
                wanted.notify_all();
        }
        void serve() {
            for (;;) {
                // The next call often comes soon. Spinning for a short time costs less than sleeping and waking.
                for (int looked = 0; looked < detail::ThreadRole::most_patience && posted == taken; ++looked)
                    detail::pause();
                std::unique_lock lock(mutex);
                wanted.wait(lock, [&] { return is_over || !jobs.empty(); });
                if (is_over) return;
                const Job job = std::move(jobs.front());
                jobs.pop_front();
                ++taken;
                lock.unlock();
                job.work(job.worker);
            }
        }
        void end() {
            {
                const std::lock_guard lock(mutex);
                is_over = true;
            }
            wanted.notify_all();
            for (std::thread& thread : threads) thread.join();
        }
    };

    bool is_of_parent() const { return ::getpid() != process_; }

    /// Binds the calling thread to processors as OpenMP's settings say.
    /// \param k   index of the worker as which the calling thread works, from 1 to `of` − 1
    /// \param of  number of workers, including the thread that uses the pool
    static void bind([[maybe_unused]] int k, [[maybe_unused]] int of) {
#if defined(_OPENMP) && defined(__linux__)
        const int places = omp_get_num_places(), first = std::max(omp_get_place_num(), 0);
        const omp_proc_bind_t how = omp_get_proc_bind();
        if (places <= 0 || how == omp_proc_bind_false) return;
        const int place = how == omp_proc_bind_master   ? first
                          : how == omp_proc_bind_spread ? int((first + std::int64_t(k) * places / of) % places)
                                                        : (first + k) % places;
        std::vector<int> processors(std::size_t(omp_get_place_num_procs(place)));
        omp_get_place_proc_ids(place, processors.data());
        cpu_set_t set;
        CPU_ZERO(&set);
        for (const int processor : processors)
            if (processor < CPU_SETSIZE) CPU_SET(processor, &set);
        sched_setaffinity(0, sizeof set, &set);
#endif
    }

    const pid_t process_ = ::getpid();
    Pool* const pool_;
};

}  // namespace firn::inline FIRN_BUILD
