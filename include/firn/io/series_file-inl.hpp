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

/// Returns the file name of one state in a series: NAME_0000.hdf for index 0, NAME_0001.hdf for index 1, …. If the
/// index is 10,000 or more, the number in the file name has more than four digits.
/// \param name   NAME
/// \param index  index of the state in the series, from 0
[[gnu::cold]] inline std::string series_member(const std::string& name, std::size_t index) {
    const auto digits = std::to_string(index);
    return name + "_" + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits + ".hdf";
}

[[gnu::cold]] inline bool is_series_member(std::string_view file, std::string_view name) {
    constexpr std::string_view ending = ".hdf";
    if (file.size() < name.size() + 5 + ending.size()) return false;
    if (!file.starts_with(name) || file[name.size()] != '_' || !file.ends_with(ending)) return false;
    const auto digits = file.substr(name.size() + 1, file.size() - name.size() - 1 - ending.size());
    return std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Returns the number in the name of a state's file, for example 12 for NAME_0012.hdf.
/// \param file  the name of the file, for which is_series_member() is true
/// \param name  NAME
[[gnu::cold]] inline std::size_t series_number(std::string_view file, std::string_view name) {
    std::size_t number = 0;
    std::from_chars(file.data() + name.size() + 1, file.data() + file.size(), number);
    return number;
}

}  // namespace detail

[[gnu::cold]] FIRN_BODY void write_series(const std::filesystem::path& path, const std::vector<SeriesEntry>& entries) {
    AtomicFile file(path);
    file.write("{\n  \"file-series-version\": \"1.0\",\n  \"files\": [");
    for (std::size_t i = 0; i < entries.size(); ++i) {
        file.write(i ? ",\n    " : "\n    ");
        file.write("{\"name\": " + detail::json_text(entries[i].file) +
                   ", \"time\": " + detail::json_number(entries[i].time) + "}");
    }
    file.write("\n  ]\n}\n");
    file.commit();
}

[[gnu::cold]] FIRN_BODY std::vector<SeriesEntry> read_series(const std::filesystem::path& path) {
    std::error_code failure;
    const auto size = std::filesystem::file_size(path, failure);
    if (failure) throw io_error(sentence("The list of states ", path, " cannot be read: ", failure.message(), "."));
    if (size > std::uintmax_t(1) << 30) {
        throw io_error(sentence("The list of states ", path, " has ", size, " bytes; at most 1 GiB is read."));
    }
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file) throw io_error(sentence("The list of states ", path, " cannot be read."));
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

namespace detail {

/// Returns the names of those files in a list of states that StateSeries may remove: all names of the form
/// NAME_0000.hdf. Returns an empty vector if the list does not exist or cannot be read.
/// \param list  the path of the list
/// \param name  NAME
[[gnu::cold]] inline std::vector<std::string> series_members_on_disk(const std::filesystem::path& list,
                                                                     std::string_view name) {
    std::vector<std::string> members;
    try {
        for (auto& entry : read_series(list)) {
            if (is_series_member(entry.file, name)) members.push_back(std::move(entry.file));
        }
    } catch (const io_error&) {
        members.clear();
    }
    return members;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
