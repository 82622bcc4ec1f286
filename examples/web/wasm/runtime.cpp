/// \file The part of a WebAssembly module that Debian's C++ library for WebAssembly lacks: exceptions that end the
/// module with their sentence, and, on shared memory, threads, which module.mjs makes from web workers.
#include "runtime.hpp"

#include <firn/core/parallel.hpp>
#include <firn/data/memory.hpp>

#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <typeinfo>

/// Ends the call of JavaScript's: throws an Error with these bytes as its message. Never returns.
extern "C" [[noreturn, clang::import_module("firn"), clang::import_name("end")]] void firn_end(const char* text,
                                                                                               std::size_t bytes);

namespace wasm {

void end(const char* sentence) { firn_end(sentence, std::strlen(sentence)); }

}  // namespace wasm

namespace {

[[noreturn]] void end_without_memory() {
    static char text[200];
    std::snprintf(text, sizeof text,
                  "The program needs more memory than the %s that the page gives it. Make the scene smaller.",
                  firn::detail::bytes_text(firn::memory_limit()).c_str());
    wasm::end(text);
}

}  // namespace

// Exceptions. The compiler leaves out every catch (-fignore-exceptions), so a throw can only end the module.

namespace __cxxabiv1 {
// Classes of the C++ ABI for the type of an exception: one without bases, one with a single base.
class __class_type_info : public std::type_info {
public:
    ~__class_type_info() override;
};
class __si_class_type_info : public __class_type_info {
public:
    ~__si_class_type_info() override;
    const __class_type_info* base;
};
}  // namespace __cxxabiv1

namespace {

/// Whether a type is std::exception or derives from it through single bases, as all exceptions of firn and of the
/// standard library do. Then an object of this type starts with its std::exception.
bool is_exception(const std::type_info* type) {
    while (*type != typeid(std::exception)) {
        if (typeid(*type) != typeid(__cxxabiv1::__si_class_type_info)) return false;
        type = static_cast<const __cxxabiv1::__si_class_type_info*>(type)->base;
    }
    return true;
}

}  // namespace

extern "C" {

void* __cxa_allocate_exception(std::size_t bytes) noexcept {
    alignas(16) static thread_local char room[256];
    return bytes <= sizeof room ? room : std::malloc(bytes);
}
void __cxa_free_exception(void*) noexcept {}

[[noreturn]] void __cxa_throw(void* thrown, std::type_info* type, void (*)(void*)) {
    if (*type == typeid(std::bad_alloc)) end_without_memory();
    if (is_exception(type)) wasm::end(static_cast<std::exception*>(thrown)->what());
    static char text[200];
    std::snprintf(text, sizeof text, "The program threw a value of the type %s, which says nothing.", type->name());
    wasm::end(text);
}

}  // extern "C"

// Memory. The C library's malloc() knows no threads.

namespace {

/// A lock for short pieces of code.
class Lock {
public:
    explicit Lock(std::atomic<bool>& held) : held_(held) {
        while (held_.exchange(true, std::memory_order_acquire)) {
        }
    }
    Lock(const Lock&) = delete;
    ~Lock() { held_.store(false, std::memory_order_release); }

private:
    std::atomic<bool>& held_;
};
constinit std::atomic<bool> memory_is_held = false;

}  // namespace

// The linker's option --wrap=NAME sends the calls of NAME to __wrap_NAME.
extern "C" {
void* __real_malloc(std::size_t);
void* __real_calloc(std::size_t, std::size_t);
void* __real_realloc(void*, std::size_t);
void* __real_aligned_alloc(std::size_t, std::size_t);
int __real_posix_memalign(void**, std::size_t, std::size_t);
void __real_free(void*);

void* __wrap_malloc(std::size_t bytes) {
    const Lock lock(memory_is_held);
    return __real_malloc(bytes);
}
void* __wrap_calloc(std::size_t count, std::size_t bytes) {
    const Lock lock(memory_is_held);
    return __real_calloc(count, bytes);
}
void* __wrap_realloc(void* from, std::size_t bytes) {
    const Lock lock(memory_is_held);
    return __real_realloc(from, bytes);
}
void* __wrap_aligned_alloc(std::size_t alignment, std::size_t bytes) {
    const Lock lock(memory_is_held);
    return __real_aligned_alloc(alignment, bytes);
}
int __wrap_posix_memalign(void** to, std::size_t alignment, std::size_t bytes) {
    const Lock lock(memory_is_held);
    return __real_posix_memalign(to, alignment, bytes);
}
void __wrap_free(void* memory) {
    const Lock lock(memory_is_held);
    __real_free(memory);
}
}  // extern "C"

namespace {

void* allocated(std::size_t bytes, std::size_t alignment = 16) {
    void* memory = nullptr;
    if (posix_memalign(&memory, alignment < 16 ? 16 : alignment, bytes > 0 ? bytes : 1) != 0) end_without_memory();
    return memory;
}

}  // namespace

void* operator new(std::size_t bytes) { return allocated(bytes); }
void* operator new[](std::size_t bytes) { return allocated(bytes); }
void* operator new(std::size_t bytes, std::align_val_t alignment) { return allocated(bytes, std::size_t(alignment)); }
void* operator new[](std::size_t bytes, std::align_val_t alignment) { return allocated(bytes, std::size_t(alignment)); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

// What module.mjs calls.

extern "C" {

/// Memory for what JavaScript hands to the program, and its return.
[[clang::export_name("firn_allocate")]] void* firn_allocate(std::size_t bytes) { return allocated(bytes); }
[[clang::export_name("firn_release")]] void firn_release(void* memory) { std::free(memory); }

/// Says how much memory [bytes] the page gives to the module.
[[clang::export_name("firn_memory")]] void firn_memory(double bytes) { firn::memory_budget = bytes; }

}  // extern "C"

// Threads.

namespace {
int threads_of_module = 1;
}

int wasm::threads() { return threads_of_module; }

/// firn asks for the number of processors if a program does not say how many threads it wants.
extern "C" long sysconf(int what) {
    if (what == _SC_NPROCESSORS_ONLN) return threads_of_module;
    return what == _SC_PAGESIZE ? 65536 : -1;
}

extern "C" {

// Variables that are made when a function first runs: the first byte of `guard` says that the variable is made, the
// second that a thread is making it.
int __cxa_guard_acquire(std::uint64_t* guard) {
    auto* const is_made = reinterpret_cast<std::atomic<bool>*>(guard);
    if (*is_made) return 0;
    while (is_made[1].exchange(true)) {
        if (*is_made) return 0;
    }
    if (!*is_made) return 1;
    is_made[1] = false;
    return 0;
}
void __cxa_guard_release(std::uint64_t* guard) {
    auto* const is_made = reinterpret_cast<std::atomic<bool>*>(guard);
    is_made[0] = true;
    is_made[1] = false;
}

}  // extern "C"

namespace {

/// The place where the calling thread leaves the next work for a helper.
struct alignas(64) Seat {
    static constexpr std::uint32_t empty = 0, full = 1, locked = 2;
    std::atomic<std::uint32_t> state = empty;
    std::atomic<std::uint32_t> sleeps = 0;
    alignas(firn::Work) char work[sizeof(firn::Work)];

    firn::Work* held() { return reinterpret_cast<firn::Work*>(work); }

    void put(const firn::Work& next) {
        for (std::uint32_t now = state;; now = state) {
            if (now == locked || !state.compare_exchange_strong(now, locked)) continue;
            if (now == full) held()->~Work();  // of a call that is over
            break;
        }
        new (work) firn::Work(next);
        state = full;
        if (sleeps.exchange(0) == 1) firn::detail::wake_one(sleeps);
    }
    void serve(int worker) {
        for (int looked = 0;;) {
            std::uint32_t now = full;
            if (state.compare_exchange_strong(now, locked)) {
                const firn::Work next = std::move(*held());
                held()->~Work();
                state = empty;
                next(worker);
                looked = 0;
            } else if (looked < most_looks) {
                ++looked;
            } else {
                sleeps = 1;
                if (state != full) firn::detail::sleep_while(sleeps, 1);
                looked = 0;
            }
        }
    }
    static constexpr int most_looks = 20000;
};

constexpr int most_threads = 64;
Seat seats[most_threads];

/// How the module has ended on another thread: 1 while the sentence is written, then 2.
struct End {
    std::atomic<std::uint32_t> state;
    char sentence[4092];
};
constinit End ending{};

void end_with_other_threads() {
    if (ending.state == 2) wasm::end(ending.sentence);
}

}  // namespace

extern "C" {

/// The address of `ending`, where module.mjs writes how a thread has ended.
[[clang::export_name("firn_ending")]] End* firn_ending() { return &ending; }

/// Runs the work of firn's calls as the worker with this index, on a thread of its own. Ends only with the module.
[[clang::export_name("firn_serve")]] void firn_serve(int worker) { seats[worker].serve(worker); }

/// From here on firn's loops run on `threads` threads.
[[clang::export_name("firn_lend")]] void firn_lend(int threads) {
    threads_of_module = threads;
    firn::detail::has_slept = end_with_other_threads;
    static const firn::LentThreads lent([](int workers, const firn::Work& work) {
        for (int k = 1; k < workers && k < threads_of_module; ++k) seats[k].put(work);
        work(0);
    });
}

}  // extern "C"
