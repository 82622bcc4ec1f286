/// \file What an exception says.
#pragma once

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

}  // namespace test_support
