/// \file The scheduler of one call: it decides which worker runs which chunks of the loops.
///
/// A phase of a loop is cut into chunks of consecutive indices. Each worker (thread) gets a share of consecutive
/// chunks. In every loop, worker k gets the same fraction of the indices. The memory that belongs to these indices then
/// stays in the cache of the worker's processor. A worker takes chunks from the front of its share. When the share is
/// empty, the worker steals chunks from the back of another worker's share. The worker that finishes the last chunk of
/// a phase starts the next phase.
///
/// A phase ends when its chunks are done, not when all workers have arrived. The caller (the thread that starts the
/// loop) waits only for workers that are running a chunk, and can run all chunks alone. If another program occupies a
/// processor, the worker on that processor delays a phase by at most one chunk: the chunk that this worker is running.
///
/// A worker that finds no chunk spins (looks for one again and again) for some microseconds, then sleeps. The caller
/// does so, too. Waking a sleeping thread takes longer than most phases. Therefore, each time that spinning has found a
/// chunk, the thread spins longer the next time. Each time that spinning has found no chunk, the thread spins only half
/// as long the next time.
#pragma once

#include <firn/core/sleep.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <exception>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// A loop of one or more phases, which run one after another.
struct PhasedLoop {
    std::span<const std::size_t> counts;  ///< the number of indices of each phase
    std::size_t grain = 1;                ///< number of indices in a chunk
    /// Function that runs one chunk: the indices first ≤ i < last of a phase.
    void (*run)(const void* body, std::size_t phase, std::size_t first, std::size_t last, int worker) = nullptr;
    const void* body = nullptr;  ///< first argument of `run`
    /// Whether each worker runs only its own share. If this is true, the loop must have one phase. If a worker is later
    /// than longest_wait_for_owner, the other workers run its share.
    bool is_owned = false;

    std::size_t chunks(std::size_t phase) const { return counts[phase] / grain + (counts[phase] % grain != 0); }
};

/// Tells the processor that this thread is waiting in a loop.
inline void pause() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

/// Returns the time [s] of a clock that is never set back.
inline double seconds_now() {
    std::timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Longest time that a loop waits for its workers to run their own shares, if PhasedLoop::is_owned is true [s]. After
/// this time, any worker may run the chunks that are left. Tests set a longer time.
inline double longest_wait_for_owner = 1e-3;

class Team;

/// What the current thread does for firn at the moment.
struct ThreadRole {
    /// The smallest and the largest value of `patience`, and the amount added to `patience` each time that spinning has
    /// found a chunk. Looking for a chunk 100 to 2000 times takes 3 to 100 µs; waking a thread takes about 50 µs.
    static constexpr int least_patience = 100, most_patience = 2000, patience_gained = 40;

    Team* team = nullptr;           ///< the team whose caller is this thread; nullptr if there is none
    bool at_work = false;           ///< whether this thread runs chunks; loops that it then starts get no helpers
    int patience = least_patience;  ///< how often the thread looks for a chunk before it sleeps
};
inline constinit thread_local ThreadRole role_of_this_thread{};

/// The workers of one call. Worker 0 is the caller. Workers 1, 2, … are helpers, which may start late or never.
class Team {
public:
    explicit Team(int workers) : seats_(std::size_t(workers)) {}
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;

    int workers() const { return int(seats_.size()); }

    /// Runs a loop on the calling thread, which must be worker 0, and on those helpers that start or wake up before the
    /// loop is finished.
    /// \param workers  largest number of workers that take part
    /// \throws anything  that a chunk throws: the first exception, after all workers have stopped. Chunks that have not
    ///                   been started when the exception is thrown are left out.
    void run(const PhasedLoop& loop, int workers);

    /// Runs chunks of all loops, as the worker with index `worker` ≥ 1, until close() is called. Returns at once if
    /// another thread already runs as this worker.
    void help(int worker) {
        Seat& seat = seats_[std::size_t(worker)];
        if (!seat.is_taken.exchange(true)) work(worker, is_closed_);
    }

    /// Makes all helpers return from help(). The caller must call close() after the last loop.
    void close() {
        is_closed_ = true;
        for (Seat& seat : seats_) wake(seat);
    }

private:
    /// The share of a worker: the chunks that the worker still has to run. word() packs all members into one integer.
    struct Share {
        static constexpr int bits = 22;
        static constexpr std::uint64_t most_chunks = (std::uint64_t(1) << bits) - 1, most_workers = 0xffff;
        std::uint64_t first, last;  ///< the chunks: first ≤ chunk < last
        std::uint64_t workers;      ///< number of workers that may take part
        std::uint64_t phase;        ///< index of the phase, counted through all loops, modulo 16

        explicit Share(std::uint64_t word)
            : first(word & most_chunks),
              last(word >> bits & most_chunks),
              workers(word >> 2 * bits & most_workers),
              phase(word >> (2 * bits + 16)) {}
        Share(std::uint64_t from, std::uint64_t to, std::uint64_t of, std::uint64_t number)
            : first(from), last(to), workers(of), phase(number) {}
        std::uint64_t word() const { return phase << (2 * bits + 16) | workers << 2 * bits | last << bits | first; }
        bool offers(std::uint64_t worker) const { return first < last && worker < workers; }
    };

    /// The state of one worker: its share packed by Share::word(), whether it sleeps (0 or 1), and whether a thread
    /// already runs as this worker.
    struct alignas(64) Seat {
        std::atomic<std::uint64_t> share = 0;
        std::atomic<std::uint32_t> sleeps = 0;
        std::atomic<bool> is_taken = false;
    };

    /// Runs chunks as the worker with index `worker` until no chunk is left and `enough` is true.
    void work(int worker, const std::atomic<bool>& enough);
    /// Runs the share of worker 0, which is the calling thread. Then waits until the other workers have run their
    /// shares, but no longer than longest_wait_for_owner. Then allows all workers to steal the chunks that are left.
    void wait_for_owners();

    /// Takes a chunk from the share of worker `from` and runs the chunk as worker `worker`. If `from` equals `worker`,
    /// this is the first chunk of the share, else the last one. Returns true if a chunk was taken, false if the worker
    /// may take no chunk of this share.
    ///
    /// loop_ is read only after the chunk is taken: until then, a share of another loop may replace this share.
    bool take(int from, int worker, std::uint64_t given_out);
    bool take_from_others(int worker, std::uint64_t given_out) {
        for (int other = 0; other < workers(); ++other)
            if (other != worker && take(other, worker, given_out)) return true;
        return false;
    }
    /// Whether worker `worker` may take a chunk of `share`, the share of worker `from`. A worker may steal only after
    /// all workers have got their shares of the phase; before that, it may soon get a share of its own.
    static bool is_offered(const Share& share, int from, int worker, std::uint64_t given_out) {
        return share.offers(std::uint64_t(worker)) && (from == worker || share.phase == given_out);
    }
    bool is_any_offered(int worker) const;

    /// Runs a chunk, unless another chunk of this loop has thrown an exception. Counts the chunk as done, whether it
    /// was run or not.
    void run_chunk(std::size_t chunk, int worker);

    /// Subtracts 1 from unfinished_. let_go() must be called once after each chunk of a phase, and once after
    /// open_phase(). The last of these calls starts the next phase.
    void let_go();

    /// Starts the next phase that has chunks, by giving every worker its share of them. Returns false if there is no
    /// such phase.
    ///
    /// unfinished_ is set to the number of chunks plus 1, so that the phase cannot end before all shares are given; the
    /// caller of open_phase() must call let_go() afterwards. Call open_phase() only when unfinished_ is 0: then no
    /// other thread uses the loop until the first share is given.
    bool open_phase();

    /// Makes the calling thread, which runs as the worker with index `worker`, sleep until wake() is called for this
    /// worker.
    ///
    /// No wake-up is lost: a worker first sets `sleeps` and then looks for chunks once more; open_phase() first gives
    /// shares and then reads `sleeps`. All threads see these reads and writes in the same order
    /// (std::memory_order_seq_cst). So either the worker sees the new share, or open_phase() sees that the worker
    /// sleeps.
    void sleep(int worker, const std::atomic<bool>& enough);
    static void wake(Seat& seat) {
        if (seat.sleeps == 0) return;
        seat.sleeps = 0;
        wake_one(seat.sleeps);
    }

    alignas(64) std::atomic<std::size_t> unfinished_ = 0;   ///< chunks not done, + 1 until all shares are given
    alignas(64) std::atomic<std::uint64_t> given_out_ = 0;  ///< index of the phase whose chunks may be stolen
    alignas(64) PhasedLoop loop_;
    std::uint64_t number_ = 0;    ///< index of the current phase, counted through all loops, modulo 16
    std::uint64_t workers_ = 0;   ///< number of workers that may take part in the loop
    std::size_t phase_ = 0;       ///< index of the current phase in its loop
    std::exception_ptr failure_;  ///< the first exception that a chunk has thrown
    std::atomic<bool> failed_ = false, is_over_ = false, is_closed_ = false;
    std::vector<Seat> seats_;
};

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/core/team-inl.hpp>
#endif
