/// \file Memory that starts on a cache line. Large allocations start on a large page and request large pages.
///
/// If each processor has its own memory (NUMA), a page is placed near the processor that first writes to it. So
/// resize() leaves new numbers unset, and each worker is the first to write to its share of new memory.
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

namespace firn {

/// A standard allocator of aligned memory. It leaves numbers unset where std::allocator sets them to zero.
template <class T>
struct aligned_allocator {
    using value_type = T;                                            ///< what it allocates
    static constexpr std::size_t large_page = std::size_t(1) << 21;  ///< size of a large page [bytes]

    aligned_allocator() = default;
    /// From an allocator of another type, as containers need it.
    template <class U>
    aligned_allocator(const aligned_allocator<U>&) {}

    /// Allocates n values.
    T* allocate(std::size_t n) {
        const std::size_t bytes = n * sizeof(T);
        void* memory = ::operator new(bytes, alignment(bytes));
#ifdef MADV_HUGEPAGE
        // Only a request: if it is refused, pages are small.
        if (bytes >= 2 * large_page) madvise(memory, bytes / large_page * large_page, MADV_HUGEPAGE);
#endif
        return static_cast<T*>(memory);
    }
    /// Constructs a value. Without arguments, numbers stay unset.
    template <class U, class... Arguments>
    void construct(U* p, Arguments&&... arguments) {
        if constexpr (sizeof...(Arguments) == 0)
            ::new (static_cast<void*>(p)) U;
        else
            ::new (static_cast<void*>(p)) U(std::forward<Arguments>(arguments)...);
    }
    /// Frees n values.
    void deallocate(T* p, std::size_t n) { ::operator delete(p, alignment(n * sizeof(T))); }
    /// Always true: any allocator can free what another has allocated.
    template <class U>
    bool operator==(const aligned_allocator<U>&) const {
        return true;
    }

private:
    static constexpr std::align_val_t alignment(std::size_t bytes) {
        return std::align_val_t(bytes >= 2 * large_page ? large_page : 64);
    }
};

/// A vector in aligned memory. resize() leaves new numbers unset.
template <class T>
using aligned_vector = std::vector<T, aligned_allocator<T>>;

namespace detail {

/// Less memory than this [bytes] is not shared among workers.
inline constexpr std::size_t least_shared_bytes = std::size_t(1) << 18;

/// Calls body(first, last) for each worker's share of n values of T. One worker gets all of little memory.
template <class T, class Body>
void for_shares_of(std::size_t n, int workers, const Body& body) {
    for_shares(n, n * sizeof(T) < least_shared_bytes ? 1 : workers, body);
}

/// Writes n numbers: the first `there` are copied, the others get `value`. Each worker writes its share.
template <class T>
void copy_and_fill(const T* from, std::size_t there, T* to, std::size_t n, const T& value, int workers) {
    for_shares_of<T>(n, workers, [&](std::size_t first, std::size_t last) {
        const std::size_t end = std::clamp(there, first, last);
        if (first < end) std::copy(from + first, from + end, to + first);
        std::fill(to + end, to + last, value);
    });
}

}  // namespace detail

/// Resizes to n numbers, unset; the old ones are lost. Each worker is the first to write to its share of new memory.
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

/// Lengthens to n numbers; new ones get `value`. Each worker is the first to write to its share of the new memory.
template <class T>
void grow(aligned_vector<T>& numbers, std::size_t n, const T& value, int workers) {
    aligned_vector<T> larger;
    larger.resize(n);
    detail::copy_and_fill(numbers.data(), numbers.size(), larger.data(), n, value, workers);
    numbers.swap(larger);
}

}  // namespace firn
