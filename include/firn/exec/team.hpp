/// \file The threads among which loops are shared out: firn's own, or, with FIRN_OPENMP_THREADS, OpenMP's.
///
/// A phase of a loop is cut into chunks. A thread takes a ticket for a chunk, runs it and takes the next one; whoever
/// finishes the last chunk of a phase opens the next phase. So a phase ends when its chunks are done, not when all
/// threads have arrived: only who holds a chunk is waited for, and the caller alone can do all of them. Where another
/// program holds a processor, a thread that does not get to run costs no more than the chunk it may hold.
///
/// A thread that finds no ticket looks for a few microseconds and then sleeps; so does the caller, which leaves its
/// processor to a thread that holds a chunk and waits for one.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <span>
#include <thread>
#include <utility>

#ifdef FIRN_OPENMP_THREADS
#ifndef _OPENMP
#error "FIRN_OPENMP_THREADS asks for OpenMP's threads: compile with -fopenmp, or leave it out for firn's own."
#endif
#include <omp.h>
#endif

namespace firn::detail {

/// Phases that follow one another, each for the indices 0 ≤ i < counts[phase], `grain` of them a chunk.
struct PhasedLoop {
    std::span<const std::size_t> counts;
    std::size_t grain = 1;
    /// Runs the chunk first ≤ i < last of a phase.
    void (*run)(const void* body, std::size_t phase, std::size_t first, std::size_t last, int thread) = nullptr;
    const void* body = nullptr;

    std::size_t chunks(std::size_t phase) const { return counts[phase] / grain + (counts[phase] % grain != 0); }
};

/// The threads of one process. One loop at a time: run_on_team() sees to that.
class Team {
public:
    Team() = default;
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;
    ~Team() {
        stop_ = true;
        for (Seat* seat = caller_.next; seat; seat = seat->next) wake(*seat);
        for (Seat* seat = caller_.next; seat; delete std::exchange(seat, seat->next))
            if (seat->worker.joinable()) seat->worker.join();
    }

    /// The process it was made in: fork() copies a team, but not its threads.
    pid_t process() const { return process_; }

    /// Runs the loop on the calling thread, thread 0, and on whichever of the threads 1 … threads − 1 come in time.
    /// Throws the first exception of a chunk once all is quiet; chunks not begun by then are left out.
    void run(const PhasedLoop& loop, int threads) {
        loop_ = loop;
        std::size_t most = 0;
        for (std::size_t phase = 0; phase < loop.counts.size(); ++phase) most = std::max(most, loop.chunks(phase));
        threads_ = std::min<std::uint64_t>({std::uint64_t(threads), most, most_threads});
        seat_threads();
        failed_ = over_ = false;
        phase_ = 0;
        open_phase();
        on_team();
        if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    }

private:
    /// A thread's place in the team.
    struct alignas(64) Seat {
        std::uint64_t thread = 0;
        std::atomic<Seat*> next = nullptr;
        std::atomic<bool> asleep = false;
        std::mutex mutex;
        std::condition_variable woken;
        std::thread worker;
    };

    /// Makes seats for threads_ threads. Fewer do as well: there may be no more threads to be had.
    void seat_threads() {
        Seat* last = &caller_;
        for (std::uint64_t thread = 1; thread < threads_; ++thread, last = last->next) {
            if (last->next) continue;
            Seat* seat = new Seat;
            seat->thread = thread;
#ifndef FIRN_OPENMP_THREADS
            try {
                seat->worker = std::thread([this, seat] { work(*seat, stop_); });
            } catch (const std::exception&) {
                delete seat;
                return;
            }
#endif
            last->next = seat;
        }
    }

    /// Returns when the loop is over. firn's own threads come by themselves.
    void on_team() {
#ifdef FIRN_OPENMP_THREADS
#pragma omp parallel num_threads(int(threads_))
        {
            Seat* seat = &caller_;
            for (int thread = omp_get_thread_num(); thread > 0; --thread) seat = seat->next;
            work(*seat, over_);
        }
#else
        work(caller_, over_);
#endif
    }

    /// Runs chunks until there are none and `enough` is set.
    void work(Seat& seat, const std::atomic<bool>& enough) {
        for (int looked = 0;;) {
            std::uint64_t tickets = tickets_;
            if (offers(tickets, seat)) {
                // Nothing read before this is used after it, so it matters not if the tickets are another loop's by
                // now.
                if (!tickets_.compare_exchange_weak(tickets, tickets - 1)) continue;
                run_chunk(chunks_ - std::size_t(tickets & most_tickets), int(seat.thread));
                looked = 0;
            } else if (enough) {
                return;
            } else if (looked < patience) {
                ++looked;
                pause();
            } else {
                sleep(seat, enough);
                looked = 0;
            }
        }
    }
    static bool offers(std::uint64_t tickets, const Seat& seat) {
        return (tickets & most_tickets) != 0 && seat.thread < tickets >> ticket_bits;
    }

    void run_chunk(std::size_t chunk, int thread) {
        if (!failed_) {
            const std::size_t first = chunk * loop_.grain, left = loop_.counts[phase_] - first;
            try {
                loop_.run(loop_.body, phase_, first, first + std::min(loop_.grain, left), thread);
            } catch (...) {
                if (!failed_.exchange(true)) failure_ = std::current_exception();
            }
        }
        if (unfinished_.fetch_sub(1) == 1) {
            ++phase_;
            open_phase();
        }
    }

    /// Called while no chunk is left or held: the loop is the calling thread's alone until it hands out tickets.
    void open_phase() {
        for (; phase_ < loop_.counts.size() && !failed_; ++phase_) {
            const std::size_t chunks = loop_.chunks(phase_);
            if (chunks == 0) continue;
            const std::uint64_t threads = std::min<std::uint64_t>(threads_, chunks);
            chunks_ = chunks;
            unfinished_ = chunks;
            tickets_ = threads << ticket_bits | chunks;
            // From here on the phase, even the loop, may be over at any time; the seats remain.
            for (Seat* seat = &caller_; seat && seat->thread < threads; seat = seat->next) wake(*seat);
            return;
        }
        over_ = true;
        wake(caller_);
#ifdef FIRN_OPENMP_THREADS
        for (Seat* seat = caller_.next; seat; seat = seat->next) wake(*seat);
#endif
    }

    /// Who sleeps says so first and looks once more; who has something to offer offers it first and then looks who
    /// sleeps. In the one order of all these accesses (std::memory_order_seq_cst) one of the two sees the other.
    void sleep(Seat& seat, const std::atomic<bool>& enough) {
        seat.asleep = true;
        if (offers(tickets_, seat) || enough) {
            seat.asleep = false;
            return;
        }
        std::unique_lock lock(seat.mutex);
        seat.woken.wait(lock, [&] { return !seat.asleep; });
    }
    static void wake(Seat& seat) {
        if (!seat.asleep) return;
        {
            const std::lock_guard lock(seat.mutex);
            seat.asleep = false;
        }
        seat.woken.notify_one();
    }

    /// Tells the processor that this thread does nothing but look.
    static void pause() {
#if defined(__x86_64__) || defined(__i386__)
        __builtin_ia32_pause();
#elif defined(__aarch64__)
        asm volatile("yield");
#endif
    }

    static constexpr int patience = 100;  ///< looks at the tickets before a thread sleeps: 2 to 5 µs
    static constexpr int ticket_bits = 48;
    static constexpr std::uint64_t most_tickets = (std::uint64_t(1) << ticket_bits) - 1;
    static constexpr std::uint64_t most_threads = (std::uint64_t(1) << (64 - ticket_bits)) - 1;

    /// Tickets left in the phase; in the bits above them, how many threads may take them.
    alignas(64) std::atomic<std::uint64_t> tickets_ = 0;
    alignas(64) std::atomic<std::size_t> unfinished_ = 0;  ///< chunks of the phase
    alignas(64) PhasedLoop loop_;
    std::uint64_t threads_ = 0;
    std::size_t phase_ = 0, chunks_ = 0;
    std::exception_ptr failure_;
    std::atomic<bool> failed_ = false, over_ = false, stop_ = false;
    const pid_t process_ = ::getpid();
    Seat caller_;
};

/// Whether a loop has the team. Still there when static objects are gone: loops in their destructors find it taken.
inline constinit std::atomic<bool> team_is_taken = false;

/// Ends the threads with the program; a forked child has none to end.
struct TeamOwner {
    Team* team = nullptr;
    ~TeamOwner() {
        if (!team_is_taken.exchange(true) && team && team->process() == ::getpid()) delete team;
    }
};

/// False, and nothing done, while another loop has the team.
inline bool run_on_team(const PhasedLoop& loop, int threads) {
    if (team_is_taken.exchange(true)) return false;
    const struct GiveBack {
        ~GiveBack() { team_is_taken = false; }
    } give_back;
    static TeamOwner owner;
    if (!owner.team || owner.team->process() != ::getpid()) owner.team = new Team;
    owner.team->run(loop, threads);
    return true;
}

}  // namespace firn::detail
