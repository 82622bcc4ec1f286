/// \file An HDF5 file built in memory and written by us, in one pass.
///
/// Why not let HDF5 write: after a failed write (a full disk) its objects stay open and the program crashes at its end
/// (1.10.8: in H5F__close_cb from exit), and H5Fclose can return success. In memory nothing fails; the disk is left to
/// AtomicFile, which reports all. Large arrays are not copied: HDF5 only gives them their place in the file.
#pragma once

#include <firn/io/atomic_file.hpp>
#include <firn/io/hdf5.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::hdf5 {

/// HDF5's core driver without a file behind it, in a buffer that we keep when HDF5 closes.
class MemoryFile {
public:
    /// `front`: bytes kept free at the front for all but the arrays, so that the buffer can end where large arrays
    /// begin. Too few cost memory and time, nothing else.
    explicit MemoryFile(std::size_t front) {
        const std::string_view tried = "build it in memory";
        const Properties access(H5Pcreate(H5P_FILE_ACCESS), tried);
        // The format of HDF5 1.8 carries checksums of everything but the values: a broken file is recognised.
        check(H5Pset_libver_bounds(access.id(), H5F_LIBVER_V18, H5F_LIBVER_V18), tried);
        constexpr std::size_t growth = std::size_t(1) << 16;
        check(H5Pset_fapl_core(access.id(), growth, false), tried);
        check(H5Pset_meta_block_size(access.id(), front), tried);
        H5FD_file_image_callbacks_t memory{allocate, copy, resize, release, same, keep, this};
        check(H5Pset_file_image_callbacks(access.id(), &memory), tried);
        const Properties creation(H5Pcreate(H5P_FILE_CREATE), tried);
        check(H5Pset_obj_track_times(creation.id(), false), tried);
        file_ = File(H5Fcreate("firn state", H5F_ACC_TRUNC, creation.id(), access.id()), tried);
    }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile() {
        file_ = File();
        std::free(data_);
    }

    hid_t id() const { return file_.id(); }

    /// Afterwards bytes() holds all that HDF5 has written.
    void close() { file_.close("build it in memory"); }
    std::span<const std::byte> bytes() const { return {data_, size_}; }

    /// The length that the file notes for itself: HDF5 file format 3.0, superblock version 2, end of file address.
    std::uint64_t noted_length() const {
        constexpr std::size_t version_at = 8, length_at = 28;
        if (size_ < 48 || data_[version_at] != std::byte{2}) {
            throw io_error("could not build it in memory (HDF5 made no superblock of version 2)");
        }
        std::uint64_t length = 0;
        for (std::size_t i = 0; i < 8; ++i) length |= std::to_integer<std::uint64_t>(data_[length_at + i]) << (8 * i);
        return length;
    }

private:
    using Operation = H5FD_file_image_op_t;

    static void* allocate(std::size_t size, Operation why, void* self) { return resize(nullptr, size, why, self); }
    static void* copy(void* to, const void* from, std::size_t size, Operation, void*) {
        return std::memcpy(to, from, size);
    }
    static void* resize(void*, std::size_t size, Operation, void* self) {
        auto& file = *static_cast<MemoryFile*>(self);
        void* grown = std::realloc(file.data_, size);
        if (!grown) return nullptr;
        file.data_ = static_cast<std::byte*>(grown);
        if (size > file.size_) std::memset(file.data_ + file.size_, 0, size - file.size_);
        file.size_ = size;
        return grown;
    }
    static herr_t release(void*, Operation, void*) { return 0; }
    static void* same(void* self) { return self; }
    static herr_t keep(void*) { return 0; }

    std::byte* data_ = nullptr;
    std::size_t size_ = 0;
    File file_;
};

/// The bytes of a file to be: what HDF5 built, and arrays with the places it gave them.
class FileImage {
public:
    /// Arrays below this size go through HDF5.
    static constexpr std::size_t large = std::size_t(1) << 18;

    explicit FileImage(std::size_t front) : file_(front) {}

    hid_t id() const { return file_.id(); }

    /// Whether `values` can be placed: large, and the same bytes in memory and in the file.
    template <class T>
    static bool can_place(std::span<const T> values) {
        return std::endian::native == std::endian::little && values.size_bytes() >= large;
    }

    /// `dataset`: contiguous, and given its place at creation (H5D_ALLOC_TIME_EARLY). `values` must outlive write().
    template <class T>
    void place(const Dataset& dataset, std::span<const T> values) {
        const haddr_t offset = H5Dget_offset(dataset.id());
        if (offset == HADDR_UNDEF || H5Dget_storage_size(dataset.id()) != values.size_bytes()) {
            throw io_error("could not find a dataset's place in the file");
        }
        pieces_.push_back({offset, std::as_bytes(values)});
    }

    /// Holds an array until the image is gone.
    template <class T>
    std::span<const T> keep(std::vector<T> values) {
        auto held = std::make_shared<const std::vector<T>>(std::move(values));
        kept_.push_back(held);
        return *held;
    }

    /// No more changes afterwards.
    void close() {
        file_.close();
        std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) { return a.offset < b.offset; });
    }

    void write(AtomicFile& file) const {
        std::uint64_t at = 0;
        for (const auto& piece : pieces_) {
            write_built(file, at, piece.offset);
            write_bytes(file, piece.bytes);
            at = piece.offset + piece.bytes.size();
        }
        write_built(file, at, std::max(at, file_.noted_length()));
    }

private:
    struct Piece {
        std::uint64_t offset;
        std::span<const std::byte> bytes;
    };

    static void write_bytes(AtomicFile& file, std::span<const std::byte> bytes) {
        file.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    }

    /// What HDF5 built of the bytes from … to; zero where it has not written.
    void write_built(AtomicFile& file, std::uint64_t from, std::uint64_t to) const {
        const auto built = file_.bytes();
        const auto end = std::min<std::uint64_t>(to, built.size());
        if (from < end) write_bytes(file, built.subspan(std::size_t(from), std::size_t(end - from)));
        static constexpr std::byte zeros[4096] = {};
        for (std::uint64_t at = std::max(from, end); at < to;) {
            const auto count = std::min<std::uint64_t>(sizeof zeros, to - at);
            write_bytes(file, std::span(zeros).first(std::size_t(count)));
            at += count;
        }
    }

    MemoryFile file_;
    std::vector<Piece> pieces_;
    std::vector<std::shared_ptr<const void>> kept_;
};

}  // namespace firn::hdf5
