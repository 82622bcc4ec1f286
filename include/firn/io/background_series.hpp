/// \file A series of states that is written while the simulation goes on.
#pragma once

#include <firn/io/state_series.hpp>

#include <condition_variable>
#include <deque>
#include <exception>
#include <iostream>
#include <mutex>
#include <thread>

namespace firn {

/// A StateSeries on a thread of its own:
///
///     firn::State<float> state = series.spare();
///     firn::state_of(simulation, state);
///     series.write(std::move(state));
///
/// No more than two states are held, one that is being written and one that waits: a third waits for the disk. A state
/// that could not be written is kept; the next call says so and lets it be tried again. What finish() has returned from
/// is whole on disk, and so is what StateSeries would have written until then; the destructor waits for the rest, too.
template <state_scalar S>
class BackgroundSeries {
public:
    /// \throws as StateSeries
    BackgroundSeries(std::filesystem::path directory, std::string name, const StateOptions& options = {})
        : series_(std::move(directory), std::move(name), options), worker_([this] { work(); }) {}
    BackgroundSeries(const BackgroundSeries&) = delete;
    BackgroundSeries& operator=(const BackgroundSeries&) = delete;
    ~BackgroundSeries() {
        {
            std::lock_guard lock(mutex_);
            ending_ = true;
        }
        changed_.notify_all();
        worker_.join();
        if (failure_ || !waiting_.empty())
            std::cerr << "firn: " << waiting_.size() << " states of " << series_.path()
                      << " could not be written; finish() would have said why.\n";
    }

    /// As StateSeries::go_on_from(). Before the first write.
    void go_on_from(double time) {
        std::lock_guard lock(mutex_);
        series_.go_on_from(time);
        written_ = series_.size();
    }

    /// Takes a state, which is written soon. Waits while two are held.
    /// \throws what StateSeries::write threw for an earlier one; this one is then not taken
    void write(State<S>&& state) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.size() < 2 || failure_; });
        throw_failure();
        waiting_.push_back(std::move(state));
        changed_.notify_all();
    }

    /// A state that was written, for its memory; or an empty one.
    State<S> spare() {
        std::lock_guard lock(mutex_);
        return std::exchange(spare_, {});
    }

    /// Waits until all is on disk. \throws what StateSeries::write threw
    void finish() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.empty() || failure_; });
        throw_failure();
    }

    /// The list's path.
    std::filesystem::path path() const { return series_.path(); }
    /// States on disk so far.
    std::size_t size() const {
        std::lock_guard lock(mutex_);
        return written_;
    }

private:
    void throw_failure() {
        if (!failure_) return;
        const std::exception_ptr failure = std::exchange(failure_, nullptr);
        changed_.notify_all();  // to be tried again
        std::rethrow_exception(failure);
    }

    void work() {
        std::unique_lock lock(mutex_);
        while (true) {
            changed_.wait(lock, [&] { return (!waiting_.empty() && !failure_) || ending_; });
            if (waiting_.empty() || failure_) return;
            State<S>& first = waiting_.front();
            lock.unlock();
            std::exception_ptr failure;
            try {
                series_.write(first);
            } catch (...) {
                failure = std::current_exception();
            }
            lock.lock();
            failure_ = failure;
            if (!failure) {
                spare_ = std::move(first);
                waiting_.pop_front();
                ++written_;
            }
            changed_.notify_all();
        }
    }

    StateSeries series_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<State<S>> waiting_;  // the first of them is being written; pushing does not move it
    State<S> spare_;
    std::exception_ptr failure_;
    std::size_t written_ = 0;
    bool ending_ = false;
    std::thread worker_;  // last: it uses all of these
};

}  // namespace firn
