/// \file What an exception says.
#pragma once

#include "support/catch.hpp"

#include <string>

namespace test_support {

/// The message of the exception of type E that f throws.
template <class E, class F>
std::string message(const F& f) {
    try {
        f();
    } catch (const E& failure) {
        return failure.what();
    }
    return "(nothing thrown)";
}

inline bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// f throws an E that says `part`.
template <class E, class F>
void check_refused(const F& f, const std::string& part) {
    const std::string said = message<E>(f);
    CAPTURE(said);
    CHECK(holds(said, part));
}

}  // namespace test_support
