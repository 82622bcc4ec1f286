/// \file A series of files NAME_0000.ENDING, NAME_0001.ENDING, …, one for each time, and a list of them. StateSeries,
/// PlySeries, ObjSeries, SplatSeries and UsdSeries are made of it.
#pragma once

#include <firn/io/series_file.hpp>
#include <firn/io/state.hpp>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A series of files on disk, and a list of them, in any format. The list is updated after each file is written. Even
/// if the program is killed, every file in the list is complete on disk.
///
/// The series replaces an older series of the same name and ending in the same folder, unless go_on_from() is called.
/// The files of the older series are kept until the first new file is on disk. Then the new list replaces the old list,
/// and the files that are only in the old list are removed. A file is removed only if its name consists of NAME_, four
/// or more digits, and the ending. If the old list cannot be read, no file is removed.
class FileSeries {
public:
    /// Reads a list, as read_series() does.
    using ReadList = std::vector<SeriesEntry> (*)(const std::filesystem::path&);
    /// Writes a list, as write_series() does.
    using WriteList = std::function<void(const std::filesystem::path&, const std::vector<SeriesEntry>&)>;

    /// Makes the folder `directory` if this folder does not exist. No file is written yet.
    /// \param directory  the folder for the files of the series
    /// \param name       the part NAME of the file names
    /// \param ending     the ending of the file names, with its dot, such as ".ply"
    /// \param list       the name of the list; if empty, NAME, the ending and ".series": NAME.ply.series
    /// \param read       reads the list
    /// \throws parameter_error  if `name` is empty, is longer than 200 bytes, or contains '/', '.' or control
    ///                          characters
    /// \throws io_error         if the folder cannot be made
    FileSeries(std::filesystem::path directory, std::string name, std::string ending, std::string list = {},
               ReadList read = read_series);

    /// Continues a series of this name that exists on disk. Call this function before the first call of write(), which
    /// then removes or overwrites the files that are later than `time`.
    /// \param time  files up to and including this time [s] are kept
    /// \throws io_error  if the list cannot be read, or if it names a file that is not of this series
    void go_on_from(double time);

    /// Writes the next file, then the list. Returns the path of the file. If the file or the list cannot be written,
    /// the earlier files stay complete and in the list, and the next call of write() uses the same file name.
    /// \param time        time of the file's contents [s]
    /// \param put         put(path) writes the file; it leaves no incomplete file (see AtomicFile) and throws if it
    /// fails
    /// \param write_list  writes the list
    /// \throws io_error   if the list cannot be written, or if a file of an older series cannot be removed; and what
    ///                    `put` throws
    std::filesystem::path write(double time, const std::function<void(const std::filesystem::path&)>& put,
                                const WriteList& write_list = write_series);

    /// Returns the path of the list.
    std::filesystem::path path() const { return directory_ / list_; }
    /// Returns the number of files in the list.
    std::size_t size() const { return entries_.size(); }
    /// Returns the files in the list, in the order in which they were written.
    const std::vector<SeriesEntry>& entries() const { return entries_; }
    /// Returns the index of the next file, which its name contains.
    std::size_t next() const { return next_; }
    /// Returns NAME.
    const std::string& name() const { return name_; }

private:
    std::vector<std::string> members_on_disk() const;

    std::filesystem::path directory_;
    std::string name_, ending_, list_;
    ReadList read_;
    std::vector<SeriesEntry> entries_;
    std::size_t next_ = 0;
    bool has_written_ = false;
};

/// A FileSeries with one state in each file, of a format that says how a state is written:
///
///     struct MyFormat {
///         struct Options {};
///         static constexpr const char* ending = ".mine";
///         static void write(const std::filesystem::path& path, const firn::State<float>& state, const Options&);
///     };
///     firn::BackgroundSeries<float, firn::SeriesOf<MyFormat>> series("out", "run");
///
/// \see BackgroundSeries
template <class Format>
class SeriesOf {
public:
    using Options = typename Format::Options;  ///< Options for writing a file.
    /// What write() takes: a state.
    template <state_scalar S>
    using Frame = State<S>;

    /// Makes the folder `directory` if this folder does not exist. No file is written yet.
    /// \param directory  the folder for the files of the series
    /// \param name       the part NAME of the file names NAME_0000, NAME_0001, …
    /// \param options    options for writing the files
    /// \throws parameter_error  if `name` is empty, is longer than 200 bytes, or contains '/', '.' or control
    ///                          characters
    /// \throws io_error         if the folder cannot be made
    SeriesOf(std::filesystem::path directory, std::string name, Options options = {})
        : files_(std::move(directory), std::move(name), Format::ending), options_(std::move(options)) {}

    /// Continues a series that exists on disk. \see FileSeries::go_on_from
    /// \param time  files up to and including this time [s] are kept
    /// \throws io_error  if the list cannot be read, or if it names a file that is not of this series
    void go_on_from(double time) { files_.go_on_from(time); }

    /// Writes the next file, then the list. Returns the path of the file. \see FileSeries::write
    /// \throws parameter_error, io_error  if the file or the list cannot be written
    template <state_scalar S>
    std::filesystem::path write(const State<S>& state) {
        return files_.write(state.time,
                            [&](const std::filesystem::path& path) { Format::write(path, state, options_); });
    }

    /// Returns the path of the list.
    std::filesystem::path path() const { return files_.path(); }
    /// Returns the number of files in the list.
    std::size_t size() const { return files_.size(); }
    /// Returns the files in the list, in the order in which they were written.
    const std::vector<SeriesEntry>& entries() const { return files_.entries(); }

private:
    FileSeries files_;
    Options options_;
};

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES_OF_STATES
#include <firn/io/file_series-inl.hpp>
#endif
