/// \file The scheduler of one call: which worker runs which chunks of its loops.
///
/// A phase of a loop is cut into chunks, and each worker has a share of them that follow one another: the same part of
/// what lies in memory, in every loop, so that it stays in that processor's cache. A worker takes a chunk from the
/// front of its share, runs it and takes the next one, or, when its share is empty, one from the back of another's;
/// whoever finishes the last chunk of a phase opens the next phase. So a phase ends when its chunks are done, not when
/// all workers have arrived: the caller waits only for chunks that a worker has begun, and can do all of them alone.
/// Where another program holds a processor, a thread that does not get to run costs no more than the chunk it may hold.
///
/// A worker that finds no chunk looks for some microseconds and then sleeps; so does the caller, which leaves its
/// processor to a worker that holds a chunk and waits for one. To be woken takes longer than most phases, so a thread
/// looks the longer the more often that was enough; where looking is in vain, as when another program has the processor
/// of whom it waits for, it soon looks no longer than it must.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <exception>
#include <span>
#include <utility>
#include <vector>

namespace firn::detail {

/// Phases that follow one another, each for the indices 0 ≤ i < counts[phase], `grain` of them a chunk.
struct PhasedLoop {
    std::span<const std::size_t> counts;
    std::size_t grain = 1;
    /// Runs the chunk first ≤ i < last of a phase.
    void (*run)(const void* body, std::size_t phase, std::size_t first, std::size_t last, int worker) = nullptr;
    const void* body = nullptr;
    /// One phase whose chunks are left to the workers whose shares they are, unless one is late.
    bool is_owned = false;

    std::size_t chunks(std::size_t phase) const { return counts[phase] / grain + (counts[phase] % grain != 0); }
};

/// Tells the processor that this thread does nothing but look.
inline void pause() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

/// Of a clock that is never set [s].
inline double seconds_now() {
    std::timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// So long [s] a worker may be late before others do what is its own. Tests give more.
inline double longest_wait_for_owner = 1e-3;

class Team;

/// What a thread does for firn now, and what it has learned.
struct ThreadRole {
    /// In looks: 3 to 100 µs. To wake a thread takes some 50.
    static constexpr int least_patience = 100, most_patience = 2000, patience_gained = 40;

    Team* team = nullptr;           ///< whose caller it is
    bool at_work = false;           ///< it runs chunks: loops in them are its own
    int patience = least_patience;  ///< looks for a chunk before it sleeps
};
inline constinit thread_local ThreadRole role_of_this_thread{};

/// The workers of one call: 0 is the caller, 1, 2, … are helpers that may come late, or not at all.
class Team {
public:
    explicit Team(int workers) : seats_(std::size_t(workers)) {}
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;

    int workers() const { return int(seats_.size()); }

    /// Runs the loop on the calling thread, which is the caller of this team, and on whichever helpers come in time.
    /// Throws the first exception of a chunk once all is quiet; chunks not begun by then are left out.
    /// \param workers  that may take part
    void run(const PhasedLoop& loop, int workers) {
        loop_ = loop;
        const std::size_t largest = *std::max_element(loop.counts.begin(), loop.counts.end());
        loop_.grain = std::max(loop.grain, largest / Share::most_chunks + 1);
        std::size_t most = 0;
        for (std::size_t phase = 0; phase < loop.counts.size(); ++phase) most = std::max(most, loop_.chunks(phase));
        workers_ = std::min({std::uint64_t(workers), std::uint64_t(most), std::uint64_t(seats_.size())});
        failed_ = is_over_ = false;
        phase_ = 0;
        if (open_phase()) let_go();
        if (loop.is_owned) wait_for_owners();
        work(0, is_over_);
        if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    }

    /// Works through loops as worker 1, 2, … until the team is closed. Returns at once if that worker is already here.
    void help(int worker) {
        Seat& seat = seats_[std::size_t(worker)];
        if (!seat.is_taken.exchange(true)) work(worker, is_closed_);
    }

    /// Lets helpers go: there are no more loops. By the caller.
    void close() {
        is_closed_ = true;
        for (Seat& seat : seats_) wake(seat);
    }

private:
    /// What a worker has left to run, in one word.
    struct Share {
        static constexpr int bits = 22;
        static constexpr std::uint64_t most_chunks = (std::uint64_t(1) << bits) - 1, most_workers = 0xffff;
        std::uint64_t first, last;  ///< first ≤ chunk < last
        std::uint64_t workers;      ///< how many may take part
        std::uint64_t phase;        ///< its number, below 16

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

    /// A worker's place in the team.
    struct alignas(64) Seat {
        std::atomic<std::uint64_t> share = 0;
        std::atomic<std::uint32_t> sleeps = 0;
        std::atomic<bool> is_taken = false;
    };

    /// Runs chunks until there are none and `enough` is set.
    void work(int worker, const std::atomic<bool>& enough) {
        ThreadRole& role = role_of_this_thread;
        const bool was_at_work = std::exchange(role.at_work, true);
        for (int looked = 0;;) {
            // Read first: whoever knows that all have their share then sees its own.
            const std::uint64_t given_out = given_out_;
            if (take(worker, worker, given_out) || take_from_others(worker, given_out)) {
                if (looked > 0) role.patience = std::min(role.patience + role.patience_gained, role.most_patience);
                looked = 0;
            } else if (enough) {
                break;
            } else if (looked < role.patience) {
                ++looked;
                pause();
            } else {
                role.patience = std::max(role.patience / 2, role.least_patience);
                sleep(worker, enough);
                looked = 0;
            }
        }
        role.at_work = was_at_work;
    }
    /// The caller runs its share, waits a while for the others to run theirs, and offers to all what is left.
    void wait_for_owners() {
        ThreadRole& role = role_of_this_thread;
        const bool was_at_work = std::exchange(role.at_work, true);
        while (take(0, 0, given_out_)) {
        }
        role.at_work = was_at_work;
        const double end = seconds_now() + longest_wait_for_owner;
        while (!is_over_ && seconds_now() < end) pause();
        given_out_ = number_;
    }

    /// Runs one chunk of a worker's share, if there is one: the first of its own, the last of another's. Nothing read
    /// before it is taken is used after that, so it matters not if the share is another loop's by then.
    bool take(int from, int worker, std::uint64_t given_out) {
        std::atomic<std::uint64_t>& left = seats_[std::size_t(from)].share;
        std::uint64_t word = left;
        for (;;) {
            Share share(word);
            if (!is_offered(share, from, worker, given_out)) return false;
            const std::uint64_t chunk = from == worker ? share.first++ : --share.last;
            if (left.compare_exchange_weak(word, share.word())) {
                run_chunk(std::size_t(chunk), worker);
                return true;
            }
        }
    }
    bool take_from_others(int worker, std::uint64_t given_out) {
        for (int other = 0; other < workers(); ++other)
            if (other != worker && take(other, worker, given_out)) return true;
        return false;
    }
    /// Others' chunks are not, before all have their share: a worker's own may come in a moment.
    static bool is_offered(const Share& share, int from, int worker, std::uint64_t given_out) {
        return share.offers(std::uint64_t(worker)) && (from == worker || share.phase == given_out);
    }
    bool is_any_offered(int worker) const {
        const std::uint64_t given_out = given_out_;
        for (int from = 0; from < workers(); ++from)
            if (is_offered(Share(seats_[std::size_t(from)].share), from, worker, given_out)) return true;
        return false;
    }

    void run_chunk(std::size_t chunk, int worker) {
        if (!failed_) {
            const std::size_t first = chunk * loop_.grain, left = loop_.counts[phase_] - first;
            try {
                loop_.run(loop_.body, phase_, first, first + std::min(loop_.grain, left), worker);
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
            const std::uint64_t workers = std::min<std::uint64_t>(workers_, chunks);
            const auto seats = std::span(seats_).first(std::size_t(workers));
            unfinished_ = chunks + 1;
            number_ = (number_ + 1) % 16;
            for (std::uint64_t k = 0; k < workers; ++k)
                seats[k].share = Share(chunks * k / workers, chunks * (k + 1) / workers, workers, number_).word();
            if (!loop_.is_owned) given_out_ = number_;
            for (Seat& seat : seats) wake(seat);
            return true;
        }
        is_over_ = true;
        wake(seats_[0]);
        return false;
    }

    /// Who sleeps says so first and looks once more; who has something to offer offers it first and then looks who
    /// sleeps. In the one order of all these accesses (std::memory_order_seq_cst) one of the two sees the other.
    void sleep(int worker, const std::atomic<bool>& enough) {
        Seat& seat = seats_[std::size_t(worker)];
        seat.sleeps = 1;
        if (is_any_offered(worker) || enough)
            seat.sleeps = 0;
        else
            seat.sleeps.wait(1);
    }
    static void wake(Seat& seat) {
        if (seat.sleeps == 0) return;
        seat.sleeps = 0;
        seat.sleeps.notify_one();
    }

    alignas(64) std::atomic<std::size_t> unfinished_ = 0;   ///< chunks of the phase, and who gives it out
    alignas(64) std::atomic<std::uint64_t> given_out_ = 0;  ///< the phase of which all have their share
    alignas(64) PhasedLoop loop_;
    std::uint64_t number_ = 0;   ///< of this phase among all of all loops, modulo 16
    std::uint64_t workers_ = 0;  ///< that may take part in the loop
    std::size_t phase_ = 0;
    std::exception_ptr failure_;
    std::atomic<bool> failed_ = false, is_over_ = false, is_closed_ = false;
    std::vector<Seat> seats_;
};

}  // namespace firn::detail
