/// \file Lets a thread sleep until another thread wakes it: std::atomic's wait() and notify_one(), also where the
/// standard library knows no threads.
///
/// The standard library of a WebAssembly module usually knows no threads: its std::atomic::wait() spins for ever. If
/// the module is compiled with atomic instructions (-matomics), firn uses the processor's own instructions instead.
#pragma once

#include <firn/core/requirements.hpp>

#include <atomic>
#include <cstdint>

namespace firn::inline FIRN_BUILD::detail {

#ifdef __wasm_atomics__

/// A function of the host program, or nullptr. A thread calls the function each time that it has slept, at the latest
/// after longest_sleep. Threads of a WebAssembly module cannot be stopped from outside, so this is where a host can end
/// a thread that would wait for ever, because the thread for which it waits has ended.
inline std::atomic<void (*)()> has_slept = nullptr;
inline constexpr std::int64_t longest_sleep = 100'000'000;  ///< [ns]

/// Makes the calling thread sleep while `number` equals `value`, until wake_one() is called. May return earlier.
inline void sleep_while(std::atomic<std::uint32_t>& number, std::uint32_t value) {
    __builtin_wasm_memory_atomic_wait32(reinterpret_cast<int*>(&number), int(value), longest_sleep);
    if (void (*const call)() = has_slept) call();
}
/// Wakes one thread that sleeps in sleep_while() because of `number`.
inline void wake_one(std::atomic<std::uint32_t>& number) {
    __builtin_wasm_memory_atomic_notify(reinterpret_cast<int*>(&number), 1);
}

#else

inline void sleep_while(std::atomic<std::uint32_t>& number, std::uint32_t value) { number.wait(value); }
inline void wake_one(std::atomic<std::uint32_t>& number) { number.notify_one(); }

#endif

}  // namespace firn::inline FIRN_BUILD::detail
