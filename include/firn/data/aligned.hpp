/// \file Vectors in aligned memory. A vector starts on a cache line (64 bytes). A vector of 4 MiB or more starts on a
/// large page (2 MiB), and the system is asked to use large pages for it.
///
/// On a machine where each processor has its own memory (NUMA), the system places a page of memory near the processor
/// that first writes to the page. So resize() leaves new numbers uninitialised, and in renew() and grow() each worker
/// (thread) is the first to write to its part of new memory.
#pragma once

#include <firn/core/parallel.hpp>

#include <algorithm>
#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace firn::inline FIRN_BUILD {

/// An allocator of aligned memory for standard containers. New numbers stay uninitialised; std::allocator would set
/// them to zero.
template <class T>
struct aligned_allocator {
    using value_type = T;                                            ///< type of the allocated values
    static constexpr std::size_t large_page = std::size_t(1) << 21;  ///< size of a large page [bytes]

    aligned_allocator() = default;
    /// Converts an allocator of another value type; standard containers require this constructor.
    template <class U>
    aligned_allocator(const aligned_allocator<U>&) {}

    /// Allocates memory for n values.
    T* allocate(std::size_t n) {
        const std::size_t bytes = n * sizeof(T);
        void* memory = ::operator new(bytes, alignment(bytes));
#ifdef MADV_HUGEPAGE
        // madvise() only asks for large pages. If the system refuses, the memory has pages of the usual size.
        if (bytes >= 2 * large_page) madvise(memory, bytes / large_page * large_page, MADV_HUGEPAGE);
#endif
        return static_cast<T*>(memory);
    }
    /// Constructs a value at address p from the arguments. Without arguments, a value that is a number stays
    /// uninitialised.
    template <class U, class... Arguments>
    void construct(U* p, Arguments&&... arguments) {
        if constexpr (sizeof...(Arguments) == 0)
            ::new (static_cast<void*>(p)) U;
        else
            ::new (static_cast<void*>(p)) U(std::forward<Arguments>(arguments)...);
    }
    /// Frees the memory that allocate(n) returned.
    void deallocate(T* p, std::size_t n) { ::operator delete(p, alignment(n * sizeof(T))); }
    /// Always true, because any aligned_allocator can free the memory of any other aligned_allocator.
    template <class U>
    bool operator==(const aligned_allocator<U>&) const {
        return true;
    }

private:
    static constexpr std::align_val_t alignment(std::size_t bytes) {
        return std::align_val_t(bytes >= 2 * large_page ? large_page : 64);
    }
};

/// A vector in aligned memory. resize() leaves new numbers uninitialised.
template <class T>
using aligned_vector = std::vector<T, aligned_allocator<T>>;

namespace detail {

/// Size of an array [bytes] below which a single worker writes the whole array.
inline constexpr std::size_t least_shared_bytes = std::size_t(1) << 18;

/// Divides the indices 0 to n − 1 of an array of type T among the workers. Each worker calls body(first, last) for its
/// part, the indices first ≤ i < last. If the array is smaller than least_shared_bytes, one worker gets all indices.
template <class T, class Body>
void for_shares_of(std::size_t n, int workers, const Body& body) {
    for_shares(n, n * sizeof(T) < least_shared_bytes ? 1 : workers, body);
}

/// Writes n values to `to`: the first `there` values are copied from `from`, all others equal `value`. The work is
/// divided among the workers.
template <class T>
void copy_and_fill(const T* from, std::size_t there, T* to, std::size_t n, const T& value, int workers) {
    for_shares_of<T>(n, workers, [&](std::size_t first, std::size_t last) {
        const std::size_t end = std::clamp(there, first, last);
        if (first < end) std::copy(from + first, from + end, to + first);
        std::fill(to + end, to + last, value);
    });
}

}  // namespace detail

/// Gives the vector n uninitialised numbers; the old numbers are lost. If this needs new memory, each worker is the
/// first to write to its part of the memory.
template <class T>
void renew(aligned_vector<T>& numbers, std::size_t n, int workers) {
    static_assert(std::is_trivially_default_constructible_v<T>);
    numbers.clear();
    const bool is_new = n > numbers.capacity();
    if (is_new) numbers.reserve(n + n / 8);
    numbers.resize(n);
    if (!is_new || workers <= 1) return;
    detail::for_shares_of<T>(n, workers, [&](std::size_t first, std::size_t last) {
        constexpr std::size_t page = 4096;
        auto* const byte = reinterpret_cast<volatile unsigned char*>(numbers.data());
        for (std::size_t at = first * sizeof(T); at < last * sizeof(T); at += page) byte[at] = 0;
    });
}

/// Lengthens the vector to n values: the old values stay, and all new values equal `value`. Each worker is the first to
/// write to its part of the new memory.
template <class T>
void grow(aligned_vector<T>& numbers, std::size_t n, const T& value, int workers) {
    aligned_vector<T> larger;
    larger.resize(n);
    detail::copy_and_fill(numbers.data(), numbers.size(), larger.data(), n, value, workers);
    numbers.swap(larger);
}

}  // namespace firn::inline FIRN_BUILD
