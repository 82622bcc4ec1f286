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

namespace firn::inline FIRN_BUILD::hdf5 {

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
        return can_place(values.size_bytes());
    }
    /// Returns whether an array of so many bytes is large enough for place() and leave_out().
    static bool can_place(std::uint64_t bytes) { return std::endian::native == std::endian::little && bytes >= large; }

    /// Makes `values` the content of `dataset`. The array is not copied: write() reads the numbers from `values`.
    /// \param dataset  a contiguous dataset that was created with H5D_ALLOC_TIME_EARLY, so that HDF5 has already
    ///                 allocated its space in the file
    /// \param values   the values of the dataset; the array must live until write() has returned
    /// \throws io_error  if HDF5 has not allocated space in the file for `dataset`, or if the size of this space is not
    ///                   the size of `values`
    template <class T>
    void place(const Dataset& dataset, std::span<const T> values) {
        pieces_.push_back({place_of(dataset, values.size_bytes()), values.size_bytes(), std::as_bytes(values)});
    }

    /// Leaves out the content of `dataset`: somebody else writes it into the file, from the offset that this function
    /// returns. write() and for_ranges() do not touch these bytes.
    /// \param dataset  a dataset as for place()
    /// \param bytes    the size of the content [bytes]; can_place(bytes) must be true
    /// \throws io_error  as place()
    std::uint64_t leave_out(const Dataset& dataset, std::uint64_t bytes) {
        const std::uint64_t offset = place_of(dataset, bytes);
        pieces_.push_back({offset, bytes, {}});
        return offset;
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

    /// Writes the whole HDF5 file, with the large arrays, to `file`. Call close() before this function. No array may
    /// have been left out.
    /// \throws io_error  if writing fails
    void write(AtomicFile& file) const {
        for_ranges([&file](std::uint64_t, std::span<const std::byte> bytes) {
            file.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        });
    }

    /// Calls put(offset, bytes) for all bytes of the file except the arrays that were left out, in the order of the
    /// offsets [bytes]. Call close() before this function.
    template <class Put>
    void for_ranges(const Put& put) const {
        std::uint64_t at = 0;
        for (const auto& piece : pieces_) {
            put_built(put, at, piece.offset);
            if (!piece.bytes.empty()) put(piece.offset, piece.bytes);
            at = piece.offset + piece.size;
        }
        put_built(put, at, std::max(at, file_.noted_length()));
    }

private:
    struct Piece {
        std::uint64_t offset, size;
        std::span<const std::byte> bytes;  // empty if the piece was left out
    };

    static std::uint64_t place_of(const Dataset& dataset, std::uint64_t bytes) {
        const haddr_t offset = H5Dget_offset(dataset.id());
        if (offset == HADDR_UNDEF || H5Dget_storage_size(dataset.id()) != bytes) {
            throw io_error("could not find a dataset's place in the file");
        }
        return offset;
    }

    /// Puts the bytes at the offsets [from, to) of the file. The bytes are taken from the buffer that HDF5 filled;
    /// beyond the end of the buffer, they are zeros.
    template <class Put>
    void put_built(const Put& put, std::uint64_t from, std::uint64_t to) const {
        const auto built = file_.bytes();
        const auto end = std::min<std::uint64_t>(to, built.size());
        if (from < end) put(from, built.subspan(std::size_t(from), std::size_t(end - from)));
        static constexpr std::byte zeros[4096] = {};
        for (std::uint64_t at = std::max(from, end); at < to;) {
            const auto count = std::min<std::uint64_t>(sizeof zeros, to - at);
            put(at, std::span<const std::byte>(zeros).first(std::size_t(count)));
            at += count;
        }
    }

    MemoryFile file_;
    std::vector<Piece> pieces_;
    std::vector<std::shared_ptr<const void>> kept_;
};

}  // namespace firn::inline FIRN_BUILD::hdf5
