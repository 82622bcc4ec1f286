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
[[gnu::cold]] inline std::string bytes_text(double bytes) {
    const std::string all = rounded_text(bytes, bytes < 0x1p53 ? 16 : 6) + " bytes";
    const char* const units[] = {"", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
    int unit = 0;
    for (; bytes >= 1024 && unit < 6; ++unit) bytes /= 1024;
    return unit == 0 ? all : rounded_text(bytes, 3) + " " + units[unit] + " (" + all + ")";
}

}  // namespace detail

/// Largest amount of memory [bytes] that the program allows itself, for example because other programs share the
/// machine; infinite unless the program sets it. \see memory_limit
inline std::atomic<double> memory_budget = std::numeric_limits<double>::infinity();

/// Returns the most memory [bytes] that this program can have: the least of the machine's memory, the limit of the
/// program's control group (Linux), the limit of its address space (`ulimit -v`; 4 GiB if a pointer has 32 bits) and
/// memory_budget. The result is infinite if no limit is known.
[[gnu::cold]] inline double memory_limit() {
    static const double of_machine = [] {
        double most = std::numeric_limits<double>::infinity();
#if defined(_SC_PHYS_PAGES) && defined(_SC_PAGESIZE)
        const auto pages = double(sysconf(_SC_PHYS_PAGES)), page = double(sysconf(_SC_PAGESIZE));
        if (pages > 0 && page > 0) most = pages * page;
#endif
        if (sizeof(void*) == 4) most = std::fmin(most, 0x1p32);
#ifdef __linux__
        // In a container, this file contains the container's memory limit: a container sees its own control group as
        // the root of all groups.
        if (std::FILE* const file = std::fopen("/sys/fs/cgroup/memory.max", "r")) {
            double of_group = 0;
            if (std::fscanf(file, "%lf", &of_group) == 1 && of_group > 0) most = std::fmin(most, of_group);
            std::fclose(file);
        }
#endif
        return most;
    }();
    double most = std::fmin(of_machine, memory_budget);
#ifdef RLIMIT_AS
    rlimit address_space{};
    if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY)
        most = std::fmin(most, double(address_space.rlim_cur));
#endif
    return most;
}

/// Checks that something fits into memory.
/// \param bytes   memory that is needed [bytes]; may be infinite
/// \param what    what needs the memory: the subject of the message's first sentence
/// \param advice  what the user can do: the message's last sentence
/// \throws memory_error  if `bytes` is more than memory_limit()
inline void require_memory(double bytes, const std::string& what, const char* advice) {
    const double most = memory_limit();
    if (bytes <= most) return;
    throw memory_error(sentence(what, " would need ", detail::bytes_text(bytes), " of memory; there are at most ",
                                detail::bytes_text(most), " here. ", advice));
}

}  // namespace firn::inline FIRN_BUILD
