/// \file Writes a series of files on a second thread while the simulation runs. The series may have any format.
#pragma once

#include <firn/core/stepper.hpp>
#include <firn/io/state.hpp>

#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace firn::inline FIRN_BUILD {

class StateSeries;

/// A series whose states are written on a second thread, while the simulation computes the next steps:
///
///     firn::State<float> state = series.spare();
///     firn::state_of(simulation, state);
///     series.write(std::move(state));
///
/// BackgroundSeries<float> is such a StateSeries; BackgroundSeries<float, firn::PlySeries> writes PLY files.
///
/// At most two states are kept in memory: one that is being written and one that waits. If there are two already,
/// write() waits until the first of them is on disk.
///
/// If a state cannot be written, this state stays in memory. The next call of write() or finish() throws the error, and
/// the thread then tries to write this state again. When finish() returns, all states and the list of states are
/// complete on disk. The destructor waits until all states are written, too; if a state cannot be written, the
/// destructor prints a warning.
/// \tparam S       precision of the states, float or double
/// \tparam Series  StateSeries (firn/io/background_series.hpp), PlySeries, ObjSeries, SplatSeries, UsdSeries, or a
///                 series of your own
/// \see SeriesOf
template <state_scalar S, class Series = StateSeries>
class BackgroundSeries {
public:
    /// Options for writing the states.
    using Options = typename Series::Options;
    /// What write() takes and spare() returns: a State; of a UsdSeries the prims of one time.
    using Frame = typename Series::template Frame<S>;

    /// Starts the thread that writes the states. Makes the folder `directory` if this folder does not exist.
    /// \param directory  the folder for the files of the series
    /// \param name       the part NAME of the file names NAME_0000.hdf, NAME_0001.hdf, …
    /// \param options    options for writing the states
    /// \throws parameter_error  if `name` is empty, is longer than 200 bytes, or contains '/', '.' or control
    ///                          characters
    /// \throws io_error         if the folder cannot be made
    BackgroundSeries(std::filesystem::path directory, std::string name, const Options& options = {})
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
            detail::warn_on_stderr(sentence(waiting_.size(), " states of ", series_.path(),
                                            " could not be written. Call finish() before the end to get the reason."));
    }

    /// Continues a series that exists on disk. Call this function before the first call of write().
    /// \param time  states up to and including this time [s] are kept; later states are removed or overwritten
    /// \throws io_error  if the list of states cannot be read, or if it names a file that is not a state of this series
    void go_on_from(double time) {
        std::lock_guard lock(mutex_);
        series_.go_on_from(time);
        written_ = series_.size();
    }

    /// Passes a state to the thread, which writes the state to disk. If two earlier states are still in memory, write()
    /// first waits until one of them is on disk.
    /// \throws parameter_error, io_error  if an earlier state could not be written; the error says why. `state` is then
    ///                                    unchanged and is not passed to the thread.
    void write(Frame&& state) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.size() < 2 || failure_; });
        throw_failure();
        waiting_.push_back(std::move(state));
        changed_.notify_all();
    }

    /// Returns a state that is already on disk, so that the memory of this state can be reused. Returns an empty state
    /// if there is no such state.
    Frame spare() {
        std::lock_guard lock(mutex_);
        return std::exchange(spare_, {});
    }

    /// Waits until all states are on disk.
    /// \throws parameter_error, io_error  if a state could not be written
    void finish() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return waiting_.empty() || failure_; });
        throw_failure();
    }

    /// Path of the list of states, such as NAME.hdf.series.
    std::filesystem::path path() const { return series_.path(); }
    /// Number of states of the series that are on disk.
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
            Frame& first = waiting_.front();
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

    Series series_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Frame> waiting_;  // the thread reads waiting_.front(), which push_back() does not move
    Frame spare_;
    std::exception_ptr failure_;
    std::size_t written_ = 0;
    bool ending_ = false;
    std::thread worker_;  // must be the last member, because the thread uses the members above
};

}  // namespace firn::inline FIRN_BUILD
