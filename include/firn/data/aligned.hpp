/// \file Memory that starts on a cache line; much memory starts on a large page, and is asked to consist of such.
#pragma once

#include <cstddef>
#include <new>
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

}  // namespace firn
