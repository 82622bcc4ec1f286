/// \file Bytes that a program lays aside on disk and reads again, in a file that has no name.
///
/// The name is removed as soon as the file is open. So the system frees the file's room when the program ends, however
/// it ends; no other file can be overwritten, and several programs can use one folder.
#pragma once

#include <firn/core/digest.hpp>
#include <firn/core/error.hpp>

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A file for records of bytes, which lie in pages, so that all room that a record leaves can be used again.
class ScratchFile {
public:
    static constexpr std::size_t page_bytes = std::size_t(1) << 16;  ///< size of a page [bytes]
    /// Returns how many pages this many bytes need.
    static std::size_t pages_for(std::size_t bytes) { return bytes / page_bytes + std::size_t(bytes % page_bytes > 0); }

    /// A record in the file, which must exist as long. Its destructor leaves the room to others.
    class Record {
    public:
        Record() = default;                                            ///< Makes no record.
        Record(Record&& other) noexcept { *this = std::move(other); }  ///< Takes the record over.
        /// Exchanges the records.
        Record& operator=(Record&& other) noexcept {
            std::swap(file_, other.file_), std::swap(pages_, other.pages_);
            std::swap(bytes_, other.bytes_), std::swap(digest_, other.digest_);
            return *this;
        }
        ~Record() {
            while (!pages_.empty()) file_->free_.push_back(pages_.back()), pages_.pop_back();
        }

    private:
        friend ScratchFile;
        ScratchFile* file_ = nullptr;
        std::vector<std::uint32_t> pages_;
        std::size_t bytes_ = 0;
        std::uint64_t digest_ = 0;
    };

    /// Makes a file without records.
    /// \param folder  the folder on whose disk the file lies
    /// \param most    how many bytes the file may have; whole pages are used
    /// \throws io_error  if there is no such folder, or no file can be made in it
    ScratchFile(std::string folder, std::size_t most)
        : folder_(std::move(folder)), most_pages_(std::min<std::size_t>(most / page_bytes, 0xffffffff)) {
        std::string name = folder_ + "/firn.XXXXXX";
#ifdef __wasi__
        errno = ENOSYS;  // it has no temporary files
#else
        fd_ = ::mkstemp(name.data());
#endif
        if (fd_ < 0) fail("Making a scratch file", errno, "Give a folder that exists and can be written.");
        ::fcntl(fd_, F_SETFD, FD_CLOEXEC);
        if (::unlink(name.c_str()) == 0) return;
        const int code = errno;
        ::close(fd_);
        fail("Removing the name of a scratch file", code, "Give a folder on a disk of this machine.");
    }
    ScratchFile(const ScratchFile&) = delete;
    ~ScratchFile() { ::close(fd_); }

    /// Returns how many pages the file may have in all.
    std::size_t most_pages() const { return most_pages_; }

    /// Writes a record that consists of these parts. Returns none if there is no room for it.
    /// \throws io_error  if writing fails; the other records stay
    [[gnu::cold]] std::optional<Record> write(std::span<const std::span<const std::byte>> parts) {
        Record record;
        record.file_ = this;
        for (const auto& part : parts) record.bytes_ += part.size();
        const std::size_t pages = pages_for(record.bytes_);
        if (pages > free_.size() + (most_pages_ - next_)) return {};
        for (std::size_t k = 0; k < pages; ++k) record.pages_.push_back(take_page());
        Check check;
        for_pieces(record, parts, [&](std::span<const std::byte> piece, std::size_t at) {
            check.add(piece);
            while (!piece.empty()) {
                const ::ssize_t written = ::pwrite(fd_, piece.data(), piece.size(), ::off_t(at));
                if (written < 0 && errno == EINTR) continue;
                if (written <= 0)
                    fail("Writing a scratch file", written < 0 ? errno : ENOSPC,
                         "Make room there, or give another folder.");
                piece = piece.subspan(std::size_t(written)), at += std::size_t(written);
            }
        });
        record.digest_ = check.value();
        return record;
    }
    /// Reads a record into parts of the same sizes as those that were written.
    /// \throws io_error  if reading fails, or if the bytes are not those that were written
    [[gnu::cold]] void read(const Record& record, std::span<const std::span<std::byte>> parts) const {
        std::size_t bytes = 0;
        for (const auto& part : parts) bytes += part.size();
        Check check;
        const auto fail_if = [&](bool wrong) {
            if (wrong)
                throw io_error("A scratch file in the folder \"" + folder_ +
                               "\" does not have the bytes that were written to it: its disk is damaged or full, or "
                               "another program has changed the file. Give another folder.");
        };
        fail_if(bytes != record.bytes_);
        for_pieces(record, parts, [&](const std::span<std::byte> piece, std::size_t at) {
            for (std::size_t done = 0; done < piece.size();) {
                const ::ssize_t there = ::pread(fd_, piece.data() + done, piece.size() - done, ::off_t(at + done));
                if (there < 0 && errno == EINTR) continue;
                if (there < 0) fail("Reading a scratch file", errno, "Give a folder on another disk.");
                fail_if(there == 0);
                done += std::size_t(there);
            }
            check.add(piece);
        });
        fail_if(check.value() != record.digest_);
    }

private:
    /// The digest of bytes, in eight parts that a processor computes side by side.
    class Check {
    public:
        void add(std::span<const std::byte> bytes) {
            std::array<Digest, 8> parts = parts_;  // in registers
            while (!bytes.empty()) {
                std::uint64_t words[8] = {};
                const std::size_t now = std::min(bytes.size(), sizeof words);
                if (now == sizeof words)
                    std::memcpy(words, bytes.data(), sizeof words);
                else
                    std::memcpy(words, bytes.data(), now);
                for (std::size_t k = 0; k < 8; ++k) parts[k].add(words[k]);
                bytes = bytes.subspan(now);
            }
            parts_ = parts;
        }
        std::uint64_t value() const {
            Digest all;
            for (const Digest& part : parts_) all.add(part.value());
            return all.value();
        }

    private:
        std::array<Digest, 8> parts_;
    };

    /// Calls body(piece, at) for each piece of the parts that lies in one page, at this place in the file.
    template <class Byte, class Body>
    static void for_pieces(const Record& record, std::span<const std::span<Byte>> parts, const Body& body) {
        std::size_t before = 0;  // bytes of the record
        for (std::span<Byte> part : parts)
            while (!part.empty()) {
                const std::size_t in_page = before % page_bytes, now = std::min(part.size(), page_bytes - in_page);
                body(part.first(now), record.pages_[before / page_bytes] * page_bytes + in_page);
                before += now, part = part.subspan(now);
            }
    }
    std::uint32_t take_page() {
        if (free_.empty()) {
            // So that a record's destructor never needs memory.
            if (free_.capacity() <= next_) free_.reserve(2 * next_ + 16);
            return std::uint32_t(next_++);
        }
        const std::uint32_t page = free_.back();
        free_.pop_back();
        return page;
    }
    [[noreturn, gnu::cold]] void fail(const char* what, int code, const char* advice) const {
        throw io_error(sentence(what, " in the folder \"", folder_, "\" failed: ", std::strerror(code), ". ", advice));
    }

    std::string folder_;
    std::size_t most_pages_, next_ = 0;  // pages from next_ on were never used
    std::vector<std::uint32_t> free_;
    int fd_ = -1;
};

}  // namespace firn::inline FIRN_BUILD
