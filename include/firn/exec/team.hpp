/// \file The threads among which loops are shared out: firn's own, or, with FIRN_OPENMP_THREADS, OpenMP's.
///
/// A phase of a loop is cut into chunks, and each thread has a share of them that follow one another: the same part of
/// what lies in memory, in every loop, so that it stays in that processor's cache. A thread takes a chunk from the
/// front of its share, runs it and takes the next one, or, when its share is empty, one from the back of another's;
/// whoever finishes the last chunk of a phase opens the next phase. So a phase ends when its chunks are done, not when
/// all threads have arrived: only who holds a chunk is waited for, and the caller alone can do all of them. Where
/// another program holds a processor, a thread that does not get to run costs no more than the chunk it may hold.
///
/// A thread that finds no chunk looks for some microseconds and then sleeps; so does the caller, which leaves its
/// processor to a thread that holds a chunk and waits for one. To be woken takes longer than most phases, so a thread
/// looks the longer the more often that was enough; where looking is in vain, as when another program has the processor
/// of whom it waits for, it soon looks no longer than it must.
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
        for (Seat* seat = caller_.next; seat; seat = seat->next)
            if (seat->worker.joinable()) seat->worker.join();
        for (Seat* seat = caller_.next; seat;) delete std::exchange(seat, seat->next);
    }

    /// The process it was made in: fork() copies a team, but not its threads.
    pid_t process() const { return process_; }

    /// Runs the loop on the calling thread, thread 0, and on whichever of the threads 1 … threads − 1 come in time.
    /// Throws the first exception of a chunk once all is quiet; chunks not begun by then are left out.
    void run(const PhasedLoop& loop, int threads) {
        loop_ = loop;
        const std::size_t largest = *std::max_element(loop.counts.begin(), loop.counts.end());
        loop_.grain = std::max(loop.grain, largest / Share::most_chunks + 1);
        std::size_t most = 0;
        for (std::size_t phase = 0; phase < loop.counts.size(); ++phase) most = std::max(most, loop_.chunks(phase));
        threads_ = std::min<std::uint64_t>({std::uint64_t(threads), most, Share::most_threads});
        seat_threads();
        failed_ = over_ = false;
        phase_ = 0;
        if (open_phase()) let_go();
        on_team();
        if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    }

private:
    /// What a thread has left to run, in one word.
    struct Share {
        static constexpr int bits = 22;
        static constexpr std::uint64_t most_chunks = (std::uint64_t(1) << bits) - 1, most_threads = 0xffff;
        std::uint64_t first, last;  ///< first ≤ chunk < last
        std::uint64_t threads;      ///< how many may take part
        std::uint64_t phase;        ///< its number, below 16

        explicit Share(std::uint64_t word)
            : first(word & most_chunks),
              last(word >> bits & most_chunks),
              threads(word >> 2 * bits & most_threads),
              phase(word >> (2 * bits + 16)) {}
        Share(std::uint64_t from, std::uint64_t to, std::uint64_t of, std::uint64_t number)
            : first(from), last(to), threads(of), phase(number) {}
        std::uint64_t word() const { return phase << (2 * bits + 16) | threads << 2 * bits | last << bits | first; }
        bool offers(std::uint64_t thread) const { return first < last && thread < threads; }
    };

    /// In looks: 3 to 100 µs. To wake a thread takes some 50.
    static constexpr int least_patience = 100, most_patience = 2000, patience_gained = 40;

    /// A thread's place in the team.
    struct alignas(64) Seat {
        std::atomic<std::uint64_t> share = 0;
        std::uint64_t thread = 0;
        int patience = least_patience;  ///< looks at the shares before it sleeps
        std::atomic<Seat*> next = nullptr;
        std::atomic<bool> asleep = false;
        std::mutex mutex;
        std::condition_variable woken;
        std::thread worker;
    };

    /// Makes seats for threads_ threads. Fewer do as well, and threads_ is lowered: there may be no more to be had.
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
                threads_ = thread;
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
            if (take(seat, seat) || take_from_others(seat)) {
                if (looked > 0) seat.patience = std::min(seat.patience + patience_gained, most_patience);
                looked = 0;
            } else if (enough) {
                return;
            } else if (looked < seat.patience) {
                ++looked;
                pause();
            } else {
                seat.patience = std::max(seat.patience / 2, least_patience);
                sleep(seat, enough);
                looked = 0;
            }
        }
    }
    /// Runs one chunk of a seat's share, if there is one: the first of its own, the last of another's. Nothing read
    /// before it is taken is used after that, so it matters not if the share is another loop's by then.
    bool take(Seat& from, const Seat& seat) {
        std::uint64_t word = from.share;
        for (;;) {
            Share share(word);
            if (!is_offered(share, from, seat)) return false;
            const std::uint64_t chunk = &from == &seat ? share.first++ : --share.last;
            if (from.share.compare_exchange_weak(word, share.word())) {
                run_chunk(std::size_t(chunk), int(seat.thread));
                return true;
            }
        }
    }
    bool take_from_others(const Seat& seat) {
        for (Seat* other = &caller_; other; other = other->next)
            if (other != &seat && take(*other, seat)) return true;
        return false;
    }
    /// Others' chunks are not, before all have their share: whose loop it is, mine may come in a moment.
    bool is_offered(const Share& share, const Seat& from, const Seat& seat) const {
        return share.offers(seat.thread) && (&from == &seat || share.phase == given_out_);
    }
    bool is_any_offered(const Seat& seat) const {
        for (const Seat* from = &caller_; from; from = from->next)
            if (is_offered(Share(from->share), *from, seat)) return true;
        return false;
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
        let_go();
    }

    /// Of a chunk, or of a phase that was held while it was given out. The last one opens the next phase.
    void let_go() {
        while (unfinished_.fetch_sub(1) == 1) {
            ++phase_;
            if (!open_phase()) return;
        }
    }

    /// Gives out the next phase that has chunks, and holds it; false if there is none. Called while nothing of a phase
    /// is left or held: the loop is the calling thread's alone until it has given out a share.
    bool open_phase() {
        for (; phase_ < loop_.counts.size() && !failed_; ++phase_) {
            const std::size_t chunks = loop_.chunks(phase_);
            if (chunks == 0) continue;
            const std::uint64_t threads = std::min<std::uint64_t>(threads_, chunks);
            const auto for_seats = [&](const auto& f) {
                for (Seat* seat = &caller_; seat && seat->thread < threads; seat = seat->next) f(*seat);
            };
            unfinished_ = chunks + 1;
            number_ = (number_ + 1) % 16;
            for_seats([&](Seat& seat) {
                const std::uint64_t k = seat.thread;
                seat.share = Share(chunks * k / threads, chunks * (k + 1) / threads, threads, number_).word();
            });
            given_out_ = number_;
            for_seats(wake);
            return true;
        }
        over_ = true;
        wake(caller_);
#ifdef FIRN_OPENMP_THREADS
        for (Seat* seat = caller_.next; seat; seat = seat->next) wake(*seat);
#endif
        return false;
    }

    /// Who sleeps says so first and looks once more; who has something to offer offers it first and then looks who
    /// sleeps. In the one order of all these accesses (std::memory_order_seq_cst) one of the two sees the other.
    void sleep(Seat& seat, const std::atomic<bool>& enough) {
        seat.asleep = true;
        if (is_any_offered(seat) || enough) {
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

    alignas(64) std::atomic<std::size_t> unfinished_ = 0;   ///< chunks of the phase, and who gives it out
    alignas(64) std::atomic<std::uint64_t> given_out_ = 0;  ///< the phase of which all have their share
    alignas(64) PhasedLoop loop_;
    std::uint64_t number_ = 0;  ///< of this phase among all of all loops, modulo 16
    std::uint64_t threads_ = 0;
    std::size_t phase_ = 0;
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
