/// \file Checks that the machine has enough memory, before memory is allocated.
///
/// Some systems, such as Linux, let a program allocate more memory than the machine has. They end the program later,
/// without a message, when it uses this memory.
#pragma once

#include <firn/core/error.hpp>

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <string>

#if defined(__unix__) || defined(__APPLE__)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns a number of bytes as text, such as "512 bytes" or "3.5 GiB (3758096384 bytes)".
[[gnu::cold]] std::string bytes_text(double bytes);

}  // namespace detail

/// Largest amount of memory [bytes] that the program allows itself, for example because other programs share the
/// machine; infinite unless the program sets it. \see memory_limit
inline std::atomic<double> memory_budget = std::numeric_limits<double>::infinity();

/// Returns the most memory [bytes] that this program can have: the least of the machine's memory, the limit of the
/// program's control group (Linux), the limit of its address space (`ulimit -v`; 4 GiB if a pointer has 32 bits) and
/// memory_budget. The result is infinite if no limit is known.
[[gnu::cold]] double memory_limit();

/// Checks that something fits into memory.
/// \param bytes   memory that is needed [bytes]; may be infinite
/// \param what    what needs the memory: the subject of the message's first sentence
/// \param advice  what the user can do: the message's last sentence
/// \throws memory_error  if `bytes` is more than memory_limit()
void require_memory(double bytes, const std::string& what, const char* advice);

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/data/memory-inl.hpp>
#endif
