/// \file Bodies of series_file.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/core/json.hpp>
#include <firn/io/atomic_file.hpp>
#include <firn/io/series_file.hpp>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the name of one file in a series: NAME_0000.hdf for index 0, NAME_0001.hdf for index 1, …. If the index is
/// 10,000 or more, the number in the file name has more than four digits.
/// \param name    NAME
/// \param index   index of the file in the series, from 0
/// \param ending  ending of the file names, with its dot
[[gnu::cold]] inline std::string series_member(const std::string& name, std::size_t index,
                                               const std::string& ending = ".hdf") {
    const auto digits = std::to_string(index);
    return name + "_" + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits + ending;
}

[[gnu::cold]] inline bool is_series_member(std::string_view file, std::string_view name,
                                           std::string_view ending = ".hdf") {
    if (file.size() < name.size() + 5 + ending.size()) return false;
    if (!file.starts_with(name) || file[name.size()] != '_' || !file.ends_with(ending)) return false;
    const auto digits = file.substr(name.size() + 1, file.size() - name.size() - 1 - ending.size());
    return std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Returns the number in the name of a file of a series, for example 12 for NAME_0012.hdf.
/// \param file  the name of the file, for which is_series_member() is true
/// \param name  NAME
[[gnu::cold]] inline std::size_t series_number(std::string_view file, std::string_view name) {
    std::size_t number = 0;
    std::from_chars(file.data() + name.size() + 1, file.data() + file.size(), number);
    return number;
}

}  // namespace detail

namespace detail {

/// Returns the text of a list of states: JSON, as ParaView reads it.
[[gnu::cold]] inline std::string series_text(const std::vector<SeriesEntry>& entries) {
    std::string text = "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [";
    for (std::size_t i = 0; i < entries.size(); ++i) {
        text += i ? ",\n    " : "\n    ";
        text += "{\"name\": " + json_text(entries[i].file) + ", \"time\": " + json_number(entries[i].time) + "}";
    }
    return text + "\n  ]\n}\n";
}

/// Returns all bytes of a file that is, or contains, a list of states.
/// \throws io_error  if the file is missing or larger than 1 GiB
[[gnu::cold]] inline std::string bytes_of_list(const std::filesystem::path& path) {
    std::error_code failure;
    const auto size = std::filesystem::file_size(path, failure);
    if (failure) throw io_error(sentence("The list of states ", path, " cannot be read: ", failure.message(), "."));
    if (size > std::uintmax_t(1) << 30) {
        throw io_error(sentence("The list of states ", path, " has ", size, " bytes; at most 1 GiB is read."));
    }
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file) throw io_error(sentence("The list of states ", path, " cannot be read."));
    return text;
}

/// Returns the entries in the text of a list of states.
/// \param path  the file of the text, for messages
/// \throws io_error  if the text is not a list of states
[[gnu::cold]] inline std::vector<SeriesEntry> entries_in(std::string_view text, const std::filesystem::path& path) {
    std::vector<SeriesEntry> entries;
    bool listed = false;
    try {
        JsonReader json(text);
        json.object([&](const std::string& key) {
            if (key != "files") return json.skip_value();
            listed = true;
            json.array([&] {
                SeriesEntry entry;
                bool named = false, timed = false;
                json.object([&](const std::string& member) {
                    if (member == "name") {
                        entry.file = json.string();
                        named = true;
                    } else if (member == "time") {
                        entry.time = json.number();
                        timed = true;
                    } else {
                        json.skip_value();
                    }
                });
                if (!named || !timed) json.fail("an entry with name and time");
                entries.push_back(std::move(entry));
            });
        });
        if (!listed || !json.at_end()) json.fail(listed ? "the end" : "a member \"files\"");
    } catch (const io_error& wrong) {
        throw io_error(sentence("The list of states ", path, " is broken at ", wrong.what(), "."));
    }
    return entries;
}

}  // namespace detail

[[gnu::cold]] FIRN_BODY void write_series(const std::filesystem::path& path, const std::vector<SeriesEntry>& entries) {
    AtomicFile file(path);
    file.write(detail::series_text(entries));
    file.commit();
}

[[gnu::cold]] FIRN_BODY std::vector<SeriesEntry> read_series(const std::filesystem::path& path) {
    return detail::entries_in(detail::bytes_of_list(path), path);
}

}  // namespace firn::inline FIRN_BUILD
