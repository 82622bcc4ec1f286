/// \file Bodies of team.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/core/team.hpp>

namespace firn::inline FIRN_BUILD::detail {

FIRN_BODY void Team::run(const PhasedLoop& loop, int workers) {
    loop_ = loop;
    const std::size_t largest = *std::max_element(loop.counts.begin(), loop.counts.end());
    loop_.grain = std::max(loop.grain, largest / std::size_t(Share::most_chunks) + 1);
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

FIRN_BODY void Team::work(int worker, const std::atomic<bool>& enough) {
    ThreadRole& role = role_of_this_thread;
    const bool was_at_work = std::exchange(role.at_work, true);
    for (int looked = 0;;) {
        // given_out_ is read before the shares. If given_out_ is the index of a phase, all shares of this phase
        // have been given, so the worker finds its own share of this phase.
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

FIRN_BODY void Team::wait_for_owners() {
    ThreadRole& role = role_of_this_thread;
    const bool was_at_work = std::exchange(role.at_work, true);
    while (take(0, 0, given_out_)) {
    }
    role.at_work = was_at_work;
    const double end = seconds_now() + longest_wait_for_owner;
    while (!is_over_ && seconds_now() < end) pause();
    given_out_ = number_;
}

FIRN_BODY bool Team::take(int from, int worker, std::uint64_t given_out) {
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

FIRN_BODY bool Team::is_any_offered(int worker) const {
    const std::uint64_t given_out = given_out_;
    for (int from = 0; from < workers(); ++from)
        if (is_offered(Share(seats_[std::size_t(from)].share), from, worker, given_out)) return true;
    return false;
}

FIRN_BODY void Team::run_chunk(std::size_t chunk, int worker) {
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

FIRN_BODY void Team::let_go() {
    while (unfinished_.fetch_sub(1) == 1) {
        ++phase_;
        if (!open_phase()) return;
    }
}

FIRN_BODY bool Team::open_phase() {
    for (; phase_ < loop_.counts.size() && !failed_; ++phase_) {
        const std::size_t chunks = loop_.chunks(phase_);
        if (chunks == 0) continue;
        const std::uint64_t workers = std::min<std::uint64_t>(workers_, chunks);
        const auto seats = std::span(seats_).first(std::size_t(workers));
        unfinished_ = chunks + 1;
        number_ = (number_ + 1) % 16;
        for (std::uint64_t k = 0; k < workers; ++k)
            seats[std::size_t(k)].share =
                Share(chunks * k / workers, chunks * (k + 1) / workers, workers, number_).word();
        if (!loop_.is_owned) given_out_ = number_;
        for (Seat& seat : seats) wake(seat);
        return true;
    }
    is_over_ = true;
    wake(seats_[0]);
    return false;
}

FIRN_BODY void Team::sleep(int worker, const std::atomic<bool>& enough) {
    Seat& seat = seats_[std::size_t(worker)];
    seat.sleeps = 1;
    if (is_any_offered(worker) || enough)
        seat.sleeps = 0;
    else
        sleep_while(seat.sleeps, 1);
}

}  // namespace firn::inline FIRN_BUILD::detail
