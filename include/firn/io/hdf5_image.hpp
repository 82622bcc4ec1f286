/// \file Builds an HDF5 file in memory, and writes the file to disk in one pass.
///
/// AtomicFile writes the file to disk, and reports every failure. HDF5 itself does not write to disk, because HDF5 does
/// not handle failed writes well, for example on a full disk: H5Fclose can return success, HDF5 objects stay open, and
/// the program crashes when it ends (HDF5 1.10.8, in H5F__close_cb, which exit() calls).
///
/// Large arrays are not copied into the file in memory: HDF5 only chooses the offset of each large array in the file.
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

/// An HDF5 file in memory (HDF5's core driver). The buffer with the file's bytes exists as long as this object, even
/// after close() was called.
class MemoryFile {
public:
    /// Creates an empty file in memory.
    /// \param front  number of bytes to reserve at the start of the file for everything except arrays. If `front` is
    ///               large enough, all large arrays come after the other content of the file, and the buffer ends
    ///               before the large arrays. If `front` is too small, only memory and time are lost.
    /// \throws io_error  if HDF5 fails
    explicit MemoryFile(std::size_t front) {
        const std::string_view tried = "build it in memory";
        const Properties access(H5Pcreate(H5P_FILE_ACCESS), tried);
        // The file format of HDF5 1.8 has checksums for everything except the values in datasets, so that damage is
        // detected.
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

    hid_t id() const { return file_.id(); }  ///< HDF5's identifier of the file.

    /// Closes the HDF5 file. Afterwards, bytes() returns everything that HDF5 wrote.
    /// \throws io_error  if HDF5 fails
    void close() { file_.close("build it in memory"); }
    /// Returns the bytes of the file. The bytes are complete only after close() was called.
    std::span<const std::byte> bytes() const { return {data_, size_}; }

    /// Returns the length of the file [bytes]. The length is read from the file's header (the "end of file address" in
    /// a superblock of version 2, HDF5 file format 3.0). It includes the large arrays, which are not in bytes().
    /// \throws io_error  if the file has no superblock of version 2
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

/// The content of an HDF5 file that is not yet on disk: the bytes that HDF5 built in memory, and the large arrays with
/// their offsets in the file.
class FileImage {
public:
    /// The smallest size of a large array [bytes]. HDF5 copies smaller arrays into its memory; large arrays are not
    /// copied.
    static constexpr std::size_t large = std::size_t(1) << 18;

    /// Creates an empty file in memory.
    /// \param front  number of bytes to reserve at the start of the file for everything except arrays
    /// \throws io_error  if HDF5 fails
    explicit FileImage(std::size_t front) : file_(front) {}

    hid_t id() const { return file_.id(); }  ///< HDF5's identifier of the file.

    /// Returns whether place() accepts the array `values`: the array must have at least `large` bytes, and the machine
    /// must be little endian, because the numbers in the file are little endian.
    template <class T>
    static bool can_place(std::span<const T> values) {
        return std::endian::native == std::endian::little && values.size_bytes() >= large;
    }

    /// Makes `values` the content of `dataset`. The array is not copied: write() reads the numbers from `values`.
    /// \param dataset  a contiguous dataset that was created with H5D_ALLOC_TIME_EARLY, so that HDF5 has already
    ///                 allocated its space in the file
    /// \param values   the values of the dataset; the array must live until write() has returned
    /// \throws io_error  if HDF5 has not allocated space in the file for `dataset`, or if the size of this space is not
    ///                   the size of `values`
    template <class T>
    void place(const Dataset& dataset, std::span<const T> values) {
        const haddr_t offset = H5Dget_offset(dataset.id());
        if (offset == HADDR_UNDEF || H5Dget_storage_size(dataset.id()) != values.size_bytes()) {
            throw io_error("could not find a dataset's place in the file");
        }
        pieces_.push_back({offset, std::as_bytes(values)});
    }

    /// Stores an array in this FileImage until the FileImage is destroyed. Returns a view of the stored array.
    template <class T>
    std::span<const T> keep(std::vector<T> values) {
        auto held = std::make_shared<const std::vector<T>>(std::move(values));
        kept_.push_back(held);
        return *held;
    }

    /// Closes the HDF5 file. Call this function after the last change of the file.
    /// \throws io_error  if HDF5 fails
    void close() {
        file_.close();
        std::sort(pieces_.begin(), pieces_.end(), [](const Piece& a, const Piece& b) { return a.offset < b.offset; });
    }

    /// Writes the whole HDF5 file, with the large arrays, to `file`. Call close() before this function.
    /// \throws io_error  if writing fails
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

    /// Writes the bytes at the offsets [from, to) of the file. The bytes are taken from the buffer that HDF5 filled;
    /// beyond the end of the buffer, zeros are written.
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
