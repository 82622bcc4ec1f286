/// \file Bodies of memory.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/data/memory.hpp>

namespace firn::inline FIRN_BUILD {

namespace detail {

[[gnu::cold]] FIRN_BODY std::string bytes_text(double bytes) {
    const std::string all = rounded_text(bytes, bytes < 0x1p53 ? 16 : 6) + " bytes";
    const char* const units[] = {"", "KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
    int unit = 0;
    for (; bytes >= 1024 && unit < 6; ++unit) bytes /= 1024;
    return unit == 0 ? all : rounded_text(bytes, 3) + " " + units[unit] + " (" + all + ")";
}

}  // namespace detail

[[gnu::cold]] FIRN_BODY double memory_limit() {
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

[[gnu::cold]] FIRN_BODY void require_memory(double bytes, const std::string& what, const char* advice) {
    const double most = memory_limit();
    if (bytes <= most) return;
    throw memory_error(sentence(what, " would need ", detail::bytes_text(bytes), " of memory; there are at most ",
                                detail::bytes_text(most), " here. ", advice));
}

}  // namespace firn::inline FIRN_BUILD
