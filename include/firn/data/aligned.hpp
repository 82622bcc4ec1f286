/// \file Memory that starts on a cache line; much memory starts on a large page, and is asked to consist of such.
///
/// A machine whose processors have memory of their own puts a page beside the processor that first writes to it. So
/// resize() leaves new numbers unset, and new memory is first written by the workers whose shares of loops it is.
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

template <class T>
struct aligned_allocator {
    using value_type = T;
    static constexpr std::size_t large_page = std::size_t(1) << 21;

    aligned_allocator() = default;
    template <class U>
    aligned_allocator(const aligned_allocator<U>&) {}

    T* allocate(std::size_t n) {
        const std::size_t bytes = n * sizeof(T);
        void* memory = ::operator new(bytes, alignment(bytes));
#ifdef MADV_HUGEPAGE
        // Only asked for: where it is refused, pages are small, as they would have been.
        if (bytes >= 2 * large_page) madvise(memory, bytes / large_page * large_page, MADV_HUGEPAGE);
#endif
        return static_cast<T*>(memory);
    }
    template <class U, class... Arguments>
    void construct(U* p, Arguments&&... arguments) {
        if constexpr (sizeof...(Arguments) == 0)
            ::new (static_cast<void*>(p)) U;
        else
            ::new (static_cast<void*>(p)) U(std::forward<Arguments>(arguments)...);
    }
    void deallocate(T* p, std::size_t n) { ::operator delete(p, alignment(n * sizeof(T))); }
    template <class U>
    bool operator==(const aligned_allocator<U>&) const {
        return true;
    }

private:
    static constexpr std::align_val_t alignment(std::size_t bytes) {
        return std::align_val_t(bytes >= 2 * large_page ? large_page : 64);
    }
};

template <class T>
using aligned_vector = std::vector<T, aligned_allocator<T>>;

namespace detail {

/// Memory of fewer bytes may lie anywhere.
inline constexpr std::size_t least_shared_bytes = std::size_t(1) << 18;

/// Calls body(first, last) for the share of each worker in memory that holds n of T; of little memory for all of it.
template <class T, class Body>
void for_shares_of(std::size_t n, int workers, const Body& body) {
    for_shares(n, n * sizeof(T) < least_shared_bytes ? 1 : workers, body);
}

/// Writes n numbers: the first `there` are copied, the others have that value. Each worker writes its share.
template <class T>
void copy_and_fill(const T* from, std::size_t there, T* to, std::size_t n, const T& value, int workers) {
    for_shares_of<T>(n, workers, [&](std::size_t first, std::size_t last) {
        const std::size_t end = std::clamp(there, first, last);
        if (first < end) std::copy(from + first, from + end, to + first);
        std::fill(to + end, to + last, value);
    });
}

}  // namespace detail

/// n numbers, unset; those that were there are lost. Of new memory each worker has its share.
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

/// More numbers, n in all, the new ones of that value. Of the new memory each worker has its share.
template <class T>
void grow(aligned_vector<T>& numbers, std::size_t n, const T& value, int workers) {
    aligned_vector<T> larger;
    larger.resize(n);
    detail::copy_and_fill(numbers.data(), numbers.size(), larger.data(), n, value, workers);
    numbers.swap(larger);
}

}  // namespace firn
