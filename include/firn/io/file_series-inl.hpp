/// \file Bodies of file_series.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/io/file_series.hpp>
#include <firn/io/series_file-inl.hpp>

#include <algorithm>
#include <string_view>
#include <system_error>
#include <utility>

namespace firn::inline FIRN_BUILD {

[[gnu::cold]] FIRN_BODY FileSeries::FileSeries(std::filesystem::path directory, std::string name, std::string ending,
                                               std::string list, ReadList read)
    : directory_(std::move(directory)),
      name_(std::move(name)),
      ending_(std::move(ending)),
      list_(std::move(list)),
      read_(read) {
    detail::check_state_name("series", name_);
    if (list_.empty()) list_ = name_ + ending_ + ".series";
    std::error_code failure;
    std::filesystem::create_directories(directory_, failure);
    if (failure || !std::filesystem::is_directory(directory_, failure)) {
        throw io_error(sentence("The folder ", directory_, " for states cannot be made: ",
                                failure ? failure.message() : "there is a file of that name", "."));
    }
}

[[gnu::cold]] FIRN_BODY void FileSeries::go_on_from(double time) {
    std::vector<SeriesEntry> kept;
    std::size_t next = 0;
    for (SeriesEntry& entry : read_(path())) {
        if (!detail::is_series_member(entry.file, name_, ending_))
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

/// Returns the names of those files in the list on disk that the series may remove: all names of the form
/// NAME_0000.ENDING. Returns an empty vector if the list does not exist or cannot be read.
[[gnu::cold]] FIRN_BODY std::vector<std::string> FileSeries::members_on_disk() const {
    std::vector<std::string> members;
    try {
        for (auto& entry : read_(path())) {
            if (detail::is_series_member(entry.file, name_, ending_)) members.push_back(std::move(entry.file));
        }
    } catch (const io_error&) {
        members.clear();
    }
    return members;
}

[[gnu::cold]] FIRN_BODY std::filesystem::path FileSeries::write(
    double time, const std::function<void(const std::filesystem::path&)>& put, const WriteList& write_list) {
    const std::string file = detail::series_member(name_, next_, ending_);
    std::vector<std::string> before;
    if (!has_written_) before = members_on_disk();
    std::error_code unknown;
    const bool is_there = std::filesystem::exists(directory_ / file, unknown);
    put(directory_ / file);
    entries_.push_back({file, time});
    try {
        write_list(path(), entries_);
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
