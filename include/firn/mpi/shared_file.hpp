/// \file A file that all ranks write, each at offsets of its own, and that gets its final name when it is complete.
#pragma once

#include <firn/io/atomic_file.hpp>
#include <firn/mpi/together.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>

namespace firn::inline FIRN_BUILD::mpi::detail {

/// A file that all ranks write under a temporary name. If commit() was not called, or threw an error, the destructor
/// removes the temporary file.
class SharedFile {
public:
    /// Creates the file on rank 0, and opens it on all others. Collective.
    /// \param path  the final name of the file; that of rank 0 counts
    /// \throws io_error  on all ranks, if the file cannot be created, or if a rank cannot open it
    SharedFile(const Communicator& all, const std::filesystem::path& path) : all_(all) {
        const auto open = [&](int flags) { fd_.emplace(temporary_, O_WRONLY | flags, "Opening for writing"); };
        Outcome created(all);
        if (all.rank() == 0)
            created.attempt([&] {
                path_ = written_file(path);
                temporary_ = temporary_name(path_);
                open(O_CREAT | O_TRUNC);
            });
        created.settle();
        pending_ = all.rank() == 0;
        path_ = all.text_of(0, path_.string());
        temporary_ = all.text_of(0, temporary_.string());
        try {
            together(all, [&] {
                if (all.rank() > 0) open(0);
            });
        } catch (...) {
            remove();
            throw;
        }
    }
    SharedFile(const SharedFile&) = delete;
    SharedFile& operator=(const SharedFile&) = delete;
    ~SharedFile() { remove(); }

    /// Writes bytes at an offset [bytes] of the file.
    /// \throws io_error  on this rank, if writing fails
    void write(std::uint64_t offset, std::span<const std::byte> bytes) const {
        while (!bytes.empty()) {
            const ::ssize_t written = ::pwrite(fd_->get(), bytes.data(), bytes.size(), ::off_t(offset));
            if (written < 0 && errno == EINTR) continue;
            if (written < 0) firn::detail::throw_io("Writing", temporary_, errno);
            bytes = bytes.subspan(std::size_t(written));
            offset += std::uint64_t(written);
        }
    }

    /// Ensures that what all ranks have written is on disk, and gives the file its final name. Collective.
    /// \param written  whether this rank has written its part without error
    /// \throws io_error  on all ranks, if a rank failed
    void commit(Outcome& written) {
        written.attempt([&] {
            firn::detail::sync_to_disk(fd_->get(), temporary_);
            fd_->close(temporary_);
        });
        written.settle();
        together(all_, [&] {
            if (all_.rank() > 0) return;
            firn::detail::rename_and_sync_folder(temporary_, path_);
            pending_ = false;
        });
    }

    const std::filesystem::path& path() const { return path_; }  ///< The final name of the file.

private:
    void remove() {
        if (!std::exchange(pending_, false)) return;
        std::error_code ignored;
        std::filesystem::remove(temporary_, ignored);
    }

    const Communicator& all_;
    std::filesystem::path path_, temporary_;
    std::optional<firn::detail::FileDescriptor> fd_;
    bool pending_ = false;
};

}  // namespace firn::inline FIRN_BUILD::mpi::detail
