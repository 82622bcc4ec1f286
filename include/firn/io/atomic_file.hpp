/// \file A file that is written under a temporary name, and gets its final name when it is complete.
///
/// A program that opens the file by its final name always sees either the complete old file or the complete new file,
/// even after a power failure. The order of operations ensures this: write the file, fsync it, rename it, and fsync its
/// folder. (The rename function of POSIX is atomic within one file system.)
///
/// Only a file is replaced. A symbolic link stays, and the file to which it leads is written. Pipes, devices, sockets
/// and folders are refused: a rename would put a file in their place.
#pragma once

#include <firn/core/error.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace firn::inline FIRN_BUILD {

namespace detail {

[[noreturn]] inline void throw_io(const char* what, const std::filesystem::path& path, int code) {
    throw io_error(sentence(what, " ", path, " failed: ", std::strerror(code), "."));
}

/// Owner of a POSIX file descriptor. Both close() and the destructor close the descriptor; only close() reports a
/// failure.
class FileDescriptor {
public:
    FileDescriptor(const std::filesystem::path& path, int flags, const char* what) {
        do {
            fd_ = ::open(path.c_str(), flags | O_CLOEXEC, 0666);
        } while (fd_ < 0 && errno == EINTR);
        if (fd_ < 0) throw_io(what, path, errno);
    }
    FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    FileDescriptor& operator=(FileDescriptor&&) = delete;
    ~FileDescriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    int get() const { return fd_; }
    /// Closes the descriptor. If the call of POSIX's close() ends with EINTR, the call is not repeated, because Linux
    /// has released the descriptor already.
    /// \param path  the name of the file, for messages
    /// \throws io_error  if closing fails
    void close(const std::filesystem::path& path) {
        if (::close(std::exchange(fd_, -1)) != 0 && errno != EINTR) throw_io("Closing", path, errno);
    }

private:
    int fd_ = -1;
};

inline void sync_to_disk(int fd, const std::filesystem::path& path) {
    while (::fsync(fd) != 0) {
        if (errno == EINTR) continue;
        throw_io("Writing to disk (fsync)", path, errno);
    }
}

/// Calls fsync for the folder that contains the file `path`, so that the new name of the file is on disk. On a file
/// system that has no fsync for folders (errors EINVAL and ENOTSUP), the function does nothing.
inline void sync_folder_of(const std::filesystem::path& path) {
    const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    FileDescriptor fd(folder, O_RDONLY | O_DIRECTORY, "Opening the folder");
    while (::fsync(fd.get()) != 0) {
        if (errno == EINTR) continue;
        if (errno == EINVAL || errno == ENOTSUP) break;
        throw_io("Writing to disk (fsync) the folder", folder, errno);
    }
    fd.close(folder);
}

[[noreturn]] inline void refuse_to_write(const std::filesystem::path& path, const char* what) {
    throw io_error(sentence("The file ", path, " cannot be written, because it is ", what,
                            ". A complete file takes the place of what is there, which must be a file or nothing: give "
                            "another name."));
}

/// Checks that there is a file or nothing at `path`.
/// \throws io_error  if there is something else, such as a device
inline void require_file_or_nothing(const std::filesystem::path& path) {
    std::error_code ignored;  // then opening or renaming tells what is wrong
    using enum std::filesystem::file_type;
    switch (std::filesystem::symlink_status(path, ignored).type()) {
        case directory:
            refuse_to_write(path, "a folder");
        case symlink:
            refuse_to_write(path, "a symbolic link");
        case fifo:
            refuse_to_write(path, "a pipe");
        case block:
        case character:
            refuse_to_write(path, "a device");
        case socket:
            refuse_to_write(path, "a socket");
        default:
            return;
    }
}

inline void rename_and_sync_folder(const std::filesystem::path& temporary, const std::filesystem::path& path) {
    require_file_or_nothing(path);
    std::error_code failure;
    std::filesystem::rename(temporary, path, failure);
    if (failure) {
        throw io_error(sentence("Renaming ", temporary, " to ", path, " failed: ", failure.message(), "."));
    }
    sync_folder_of(path);
}

}  // namespace detail

/// Returns the file that is made or replaced when `path` is written: `path`, or, if this is a symbolic link, where the
/// link leads.
/// \throws io_error  if there is a folder, a pipe, a device or a socket, or a link to an open file of a process
///                   (/dev/stdout), or if links lead round in a circle
inline std::filesystem::path written_file(std::filesystem::path path) {
    std::error_code ignored;  // then opening tells what is wrong
    for (int links = 0; is_symlink(symlink_status(path, ignored)); ++links) {
        if (links == 40) detail::refuse_to_write(path, "one of too many symbolic links in a row");
        const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
        // Such links name a file, but lead to one that is open, which the process would go on to write.
        if (canonical(folder, ignored).string().starts_with("/proc/"))
            detail::refuse_to_write(path, "an open file of a process");
        path = folder / read_symlink(path, ignored);
    }
    detail::require_file_or_nothing(path);
    return path;
}

/// Returns the temporary name `NAME.tmp.PID` of the file `NAME`. The temporary file is in the same folder as the file,
/// and therefore on the same file system.
///
/// PID is the process id, so different processes get different names. Programs that look for states or meshes ignore
/// the temporary file, because its name does not end with .hdf, .obj, ….
inline std::filesystem::path temporary_name(const std::filesystem::path& path) {
    auto name = path;
    name += ".tmp." + std::to_string(::getpid());
    return name;
}

/// Gives a complete, closed file its final name, and ensures that the file is on disk. Use this function for a file
/// that another library wrote. The order of operations is: fsync the file, rename it to `path` (an old file of that
/// name is replaced), and fsync the folder. \see written_file()
/// \param temporary  the present name of the file; the file is removed if an operation fails
/// \param path       the final name, in the same folder; if it is a link, to a file on the same file system
/// \throws io_error  if an operation fails. The old file at `path` is then unchanged, with one exception: if only the
///                   fsync of the folder failed, the new file is at `path`, but may not be on disk yet.
inline void sync_and_rename(const std::filesystem::path& temporary, const std::filesystem::path& path) {
    try {
        // Nothing is written here, but O_RDWR is needed: on some file systems, fsync of a read-only descriptor fails.
        detail::FileDescriptor fd(temporary, O_RDWR, "Opening");
        detail::sync_to_disk(fd.get(), temporary);
        fd.close(temporary);
        detail::rename_and_sync_folder(temporary, written_file(path));
    } catch (...) {
        std::error_code ignored;
        std::filesystem::remove(temporary, ignored);
        throw;
    }
}

/// A file that has a temporary name until commit() gives it the final name. If commit() was not called, or if commit()
/// threw an error, the destructor removes the temporary file.
class AtomicFile {
public:
    /// Creates the temporary file. Its name is temporary_name(written_file(path)).
    /// \param path  the final name of the file, or a symbolic link to it
    /// \throws io_error  if the folder does not exist or is not writable, or if `path` cannot be replaced by a file,
    ///                   see written_file()
    explicit AtomicFile(std::filesystem::path path)
        : path_(written_file(std::move(path))),
          temporary_(temporary_name(path_)),
          fd_(temporary_, O_WRONLY | O_CREAT | O_TRUNC, "Opening for writing") {
        pending_ = true;
        buffer_.reserve(buffer_bytes);
    }
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile() {
        if (!pending_) return;
        std::error_code ignored;
        std::filesystem::remove(temporary_, ignored);
    }

    /// Appends bytes to the file. The bytes may stay in memory until commit() is called.
    /// \throws io_error  if writing fails
    void write(std::string_view bytes) {
        if (buffer_.size() + bytes.size() > buffer_bytes) flush();
        if (bytes.size() > buffer_bytes)
            write_through(bytes);
        else
            buffer_ += bytes;
    }

    /// Finishes the file: when commit() returns, the file is complete on disk, with its final name.
    /// \throws io_error  if writing or renaming fails, or if an earlier call of commit() succeeded
    void commit() {
        if (!pending_) throw io_error(sentence("The file ", path_, " was already committed; open a new one."));
        flush();
        detail::sync_to_disk(fd_.get(), temporary_);
        fd_.close(temporary_);
        detail::rename_and_sync_folder(temporary_, path_);
        pending_ = false;
    }

    const std::filesystem::path& path() const { return path_; }            ///< The file's final name.
    const std::filesystem::path& temporary() const { return temporary_; }  ///< The file's temporary name.

private:
    static constexpr std::size_t buffer_bytes = std::size_t(1) << 16;

    void flush() {
        write_through(buffer_);
        buffer_.clear();
    }
    void write_through(std::string_view bytes) {
        while (!bytes.empty()) {
            const ::ssize_t written = ::write(fd_.get(), bytes.data(), bytes.size());
            if (written < 0 && errno == EINTR) continue;
            if (written < 0) detail::throw_io("Writing", temporary_, errno);
            bytes.remove_prefix(std::size_t(written));
        }
    }

    std::filesystem::path path_;
    std::filesystem::path temporary_;
    detail::FileDescriptor fd_;
    std::string buffer_;
    bool pending_ = false;
};

}  // namespace firn::inline FIRN_BUILD
