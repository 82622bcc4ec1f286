/// \file Writes a series of states while the simulation runs.
#pragma once

#include <firn/io/state_series.hpp>

#include <condition_variable>
#include <deque>
#include <exception>
#include <iostream>
#include <mutex>
#include <thread>

namespace firn {

/// Writes a StateSeries on its own thread:
///
///     firn::State<float> state = series.spare();
///     firn::state_of(simulation, state);
///     series.write(std::move(state));
///
/// It holds at most two states: one being written and one waiting. The third call of write() waits for the disk.
///
/// If a state cannot be written, it is kept. The next call throws the error, and the thread tries the state again. When
/// finish() returns, all states and their list are whole on disk. The destructor waits for the states that it holds,
/// but only prints a warning if one cannot be written.
template <state_scalar S>
class BackgroundSeries {
public:
    /// Makes the series as StateSeries does and starts the thread.
    /// \throws parameter_error, io_error  as StateSeries
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
                      << " could not be written. Call finish() before the end to get the reason.\n";
    }

    /// Continues an existing series, as StateSeries::go_on_from(). Call it before the first write.
    /// \param time  states up to this time stay [s]
    /// \throws io_error  as StateSeries::go_on_from()
    void go_on_from(double time) {
        std::lock_guard lock(mutex_);
        series_.go_on_from(time);
        written_ = series_.size();
    }

    /// Takes a state to be written soon. Waits while two are held.
    /// \throws parameter_error, io_error  if StateSeries::write() threw it for an earlier state; `state` is then not
    ///         taken
    void write(State<S>&& state) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.size() < 2 || failure_; });
        throw_failure();
        waiting_.push_back(std::move(state));
        changed_.notify_all();
    }

    /// Returns a state that was written, so that its memory can be reused, or an empty one.
    State<S> spare() {
        std::lock_guard lock(mutex_);
        return std::exchange(spare_, {});
    }

    /// Waits until all states are on disk.
    /// \throws parameter_error, io_error  if StateSeries::write() threw it
    void finish() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.empty() || failure_; });
        throw_failure();
    }

    /// Path of the list, NAME.hdf.series.
    std::filesystem::path path() const { return series_.path(); }
    /// Number of states on disk.
    std::size_t size() const {
        std::lock_guard lock(mutex_);
        return written_;
    }

private:
    void throw_failure() {
        if (!failure_) return;
        const std::exception_ptr failure = std::exchange(failure_, nullptr);
        changed_.notify_all();  // the thread tries again
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
    std::deque<State<S>> waiting_;  // the first is being written; push_back() does not move it
    State<S> spare_;
    std::exception_ptr failure_;
    std::size_t written_ = 0;
    bool ending_ = false;
    std::thread worker_;  // last, because it uses all of the above
};

}  // namespace firn
