/// \file Writes a series of states on a second thread while the simulation runs.
#pragma once

#include <firn/io/state_series.hpp>

#include <condition_variable>
#include <deque>
#include <exception>
#include <iostream>
#include <mutex>
#include <thread>

namespace firn {

/// Writes the states of a StateSeries on a thread of its own, while the simulation computes the next steps:
///
///     firn::State<float> state = series.spare();
///     firn::state_of(simulation, state);
///     series.write(std::move(state));
///
/// At most two states are kept in memory: one that is being written and one that waits. If there are two, write() waits
/// until the first is on disk.
///
/// If a state cannot be written, the state is kept. The next call of write() or finish() throws the error, and the
/// thread tries to write the state again. When finish() returns, all states and the list of states are complete on
/// disk. The destructor also waits until all states are written. If one cannot be written, a warning is printed.
template <state_scalar S>
class BackgroundSeries {
public:
    /// Makes the folder of the series if it does not exist, and starts the thread.
    /// \param directory  the folder
    /// \param name       NAME in the names of the files, NAME_0000.hdf, …
    /// \param options    how each state is written
    /// \throws parameter_error  if `name` is empty, too long, or contains '/', '.' or control characters
    /// \throws io_error         if the folder cannot be made
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

    /// Continues a series that exists on disk. Call it before the first write.
    /// \param time  states up to this time are kept; later ones are removed or overwritten [s]
    /// \throws io_error  if the list cannot be read, or names a file that is not a state of this series
    void go_on_from(double time) {
        std::lock_guard lock(mutex_);
        series_.go_on_from(time);
        written_ = series_.size();
    }

    /// Gives a state to the thread, which writes it to disk. If two earlier states are still in memory, write() first
    /// waits until one of them is on disk.
    /// \throws parameter_error, io_error  the error of an earlier state that could not be written; `state` is then
    ///         unchanged and will not be written
    void write(State<S>&& state) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.size() < 2 || failure_; });
        throw_failure();
        waiting_.push_back(std::move(state));
        changed_.notify_all();
    }

    /// Returns a state that has been written, so that its memory can be reused; an empty state if there is none.
    State<S> spare() {
        std::lock_guard lock(mutex_);
        return std::exchange(spare_, {});
    }

    /// Waits until all states are on disk.
    /// \throws parameter_error, io_error  the error of a state that could not be written
    void finish() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.empty() || failure_; });
        throw_failure();
    }

    /// Path of the list of states, NAME.hdf.series.
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
        changed_.notify_all();  // wakes the thread, which tries to write the state again
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
    std::deque<State<S>> waiting_;  // the first state is being written; push_back() does not move its memory
    State<S> spare_;
    std::exception_ptr failure_;
    std::size_t written_ = 0;
    bool ending_ = false;
    std::thread worker_;  // the last member, because the thread uses the members above
};

}  // namespace firn
