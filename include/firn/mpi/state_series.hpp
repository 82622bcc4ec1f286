/// \file Writes the states of a run on many ranks as a series of files, and a list of these files.
#pragma once

#include <firn/io/state_series-inl.hpp>
#include <firn/mpi/state_writer.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace firn::inline FIRN_BUILD::mpi {

/// A series of states of a run on many ranks: firn::StateSeries, whose files all ranks write together. The files and
/// the list have the same names and bytes as those of a run without MPI. All functions except path() and size() are
/// collective. A state is on disk when write() returns: there is no series that writes in the background on many ranks.
class StateSeries {
public:
    /// Makes the folder `directory` if this folder does not exist. No file is written yet. \see firn::StateSeries
    /// \param all        the ranks
    /// \param directory  the folder for the files of the series; that of rank 0 counts
    /// \param name       the part NAME of the file names NAME_0000.hdf, NAME_0001.hdf, …
    /// \param options    options for writing the states
    /// \throws parameter_error, io_error  as firn::StateSeries; all ranks throw the same error
    StateSeries(const Communicator& all, std::filesystem::path directory, std::string name,
                const StateOptions& options = {})
        : all_(all), path_(directory / (name + ".hdf.series")), options_(options) {
        on_rank_0([&] { series_.emplace(std::move(directory), std::move(name), options); });
    }

    /// Continues a series of this name that exists on disk. \see firn::StateSeries::go_on_from
    /// \param time  states up to and including this time [s] are kept
    /// \throws io_error  as firn::StateSeries; all ranks throw the same error
    void go_on_from(double time) {
        on_rank_0([&] { series_->go_on_from(time); });
    }

    /// Writes the next state, then the list of states. Returns the path of the state's file.
    /// \see firn::StateSeries::write
    /// \param mine  the state of this rank, as for write_state()
    /// \throws usage_error, parameter_error, io_error  as write_state() and firn::StateSeries; all ranks throw the same
    template <state_scalar S>
    std::filesystem::path write(const State<S>& mine) {
        detail::Outcome outcome(all_);
        std::filesystem::path file;
        // Rank 0 tells the others how it goes on: with which file, and whether the file has all fields.
        const auto put = [&](const std::filesystem::path& path, const StateOptions& options) {
            write_state(all_, path, mine, options);
        };
        if (all_.rank() == 0) {
            bool begun = false;
            outcome.attempt([&] {
                file = series_->write_with(mine.time, [&](const auto& path, const StateOptions& options) {
                    begun = true;
                    all_.text_of(0, (options.fields.empty() ? "a" : "s") + path.string());
                    put(path, options);
                });
            });
            if (!begun) all_.text_of(0, "");
        } else if (const std::string how = all_.text_of(0, ""); !how.empty()) {
            file = how.substr(1);
            StateOptions options = options_;
            if (how[0] == 'a') options.fields.clear();
            outcome.attempt([&] { put(file, options); });
        }
        outcome.settle();
        agree_on_size();
        return file;
    }

    /// Returns the path of the list of states, NAME.hdf.series.
    const std::filesystem::path& path() const { return path_; }
    /// Returns the number of states in the list.
    std::size_t size() const { return size_; }

private:
    template <class F>
    void on_rank_0(const F& f) {
        detail::together(all_, [&] {
            if (all_.rank() == 0) f();
        });
        agree_on_size();
    }
    void agree_on_size() { size_ = std::size_t(all_.sum(series_ ? std::uint64_t(series_->size()) : 0)); }

    Communicator all_;
    std::filesystem::path path_;
    StateOptions options_;
    std::optional<firn::StateSeries> series_{};  // on rank 0
    std::size_t size_ = 0;
};

}  // namespace firn::inline FIRN_BUILD::mpi
