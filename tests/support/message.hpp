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

/// read(text), where `by` replaces a part of the text, throws an E that begins with this line of it and says `says`.
template <class E, class Read>
void check_mistake(const Read& read, std::string text, const std::string& part, const std::string& by, int line,
                   const std::string& says) {
    const auto at = text.find(part);
    REQUIRE(at != std::string::npos);
    text.replace(at, part.size(), by);
    const std::string said = message<E>([&] { read(text); });
    CAPTURE(said, part, by, line, says);
    CHECK(said.rfind("line " + std::to_string(line) + ", ", 0) == 0);
    CHECK(holds(said, says));
}

}  // namespace test_support
