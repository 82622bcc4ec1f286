/// \file Bodies of state_series.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/io/series_file-inl.hpp>
#include <firn/io/state_series.hpp>

#include <algorithm>
#include <string_view>
#include <system_error>
#include <utility>

namespace firn::inline FIRN_BUILD {

[[gnu::cold]] FIRN_BODY StateSeries::StateSeries(std::filesystem::path directory, std::string name,
                                                 const StateOptions& options)
    : directory_(std::move(directory)), name_(std::move(name)), options_(options) {
    detail::check_state_name("series", name_);
    std::error_code failure;
    std::filesystem::create_directories(directory_, failure);
    if (failure || !std::filesystem::is_directory(directory_, failure)) {
        throw io_error(sentence("The folder ", directory_, " for states cannot be made: ",
                                failure ? failure.message() : "there is a file of that name", "."));
    }
}

[[gnu::cold]] FIRN_BODY void StateSeries::go_on_from(double time) {
    std::vector<SeriesEntry> kept;
    std::size_t next = 0;
    for (SeriesEntry& entry : read_series(path())) {
        if (!detail::is_series_member(entry.file, name_))
            throw io_error(sentence("The list of states ", path(), " names '", entry.file,
                                    "', which is not a state of the series '", name_, "'. Use another name."));
        if (entry.time > time) continue;
        next = std::max(next, detail::series_number(entry.file, name_) + 1);
        kept.push_back(std::move(entry));
    }
    entries_ = std::move(kept);
    next_ = next;
    has_written_ = false;
}

template <state_scalar S>
[[gnu::cold]] std::filesystem::path StateSeries::write(const State<S>& state) {
    return write_with(state.time, [&](const std::filesystem::path& file, const StateOptions& options) {
        write_state(file, state, options);
    });
}

[[gnu::cold]] FIRN_BODY std::filesystem::path StateSeries::write_with(
    double time, const std::function<void(const std::filesystem::path&, const StateOptions&)>& put) {
    const std::string file = detail::series_member(name_, next_);
    std::vector<std::string> before;
    if (!has_written_) before = detail::series_members_on_disk(path(), name_);
    std::error_code unknown;
    const bool is_there = std::filesystem::exists(directory_ / file, unknown);
    StateOptions options = options_;
    if (options.complete_every > 0 && next_ % options.complete_every == 0) options.fields.clear();
    put(directory_ / file, std::as_const(options));
    entries_.push_back({file, time});
    try {
        write_series(path(), entries_);
    } catch (...) {
        entries_.pop_back();
        std::error_code ignored;
        // A file that existed before this call is kept.
        if (!is_there) std::filesystem::remove(directory_ / file, ignored);
        throw;
    }
    ++next_;
    has_written_ = true;
    for (const auto& stale : before) {
        if (std::ranges::any_of(entries_, [&](const SeriesEntry& entry) { return entry.file == stale; })) continue;
        std::error_code failure;
        std::filesystem::remove(directory_ / stale, failure);
        if (failure) {
            throw io_error(sentence("The state ", directory_ / stale,
                                    " of an older series cannot be removed: ", failure.message(), "."));
        }
    }
    return directory_ / file;
}

}  // namespace firn::inline FIRN_BUILD
