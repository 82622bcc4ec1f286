/// \file Checks of the programs that run on a device: each prints a line, and the last line counts them.
#pragma once

#include <firn/core/error.hpp>

#include <bit>
#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

namespace checks {

inline int passed = 0, failed = 0;

inline void check(bool good, const std::string& what, const std::string& seen = {}) {
    ++(good ? passed : failed);
    std::cout << (good ? "ok   " : "FAIL ") << what << (good || seen.empty() ? "" : ": " + seen) << '\n';
}

/// That f throws an Error with all of these in its message.
template <class Error, class F>
void check_throws(const std::string& what, const std::vector<std::string>& parts, const F& f) {
    try {
        f();
        check(false, what, "nothing is thrown");
    } catch (const Error& e) {
        const std::string message = e.what();
        bool good = true;
        for (const std::string& part : parts) good = good && message.find(part) != std::string::npos;
        check(good, what, message);
    } catch (const std::exception& e) {
        check(false, what, firn::sentence("an error of another type: ", e.what()));
    }
}

/// That two lists of numbers have the same bits.
template <class T>
void check_same_bits(const std::string& what, const std::vector<T>& got, const std::vector<T>& expected) {
    std::size_t unlike = got.size() == expected.size() ? 0 : 1, first = 0;
    for (std::size_t i = std::min(got.size(), expected.size()); i-- > 0;)
        if (std::bit_cast<std::uint32_t>(got[i]) != std::bit_cast<std::uint32_t>(expected[i])) ++unlike, first = i;
    check(unlike == 0 && !got.empty(), firn::sentence(what, ": ", got.size(), " numbers"),
          firn::sentence(unlike, " differ from the ", expected.size(), " expected, the first is [", first, "]"));
}

/// Prints how many checks passed. \return the exit code of the program
inline int finish() {
    std::cout << passed << " passed, " << failed << " failed\n";
    return failed ? 1 : 0;
}

}  // namespace checks
