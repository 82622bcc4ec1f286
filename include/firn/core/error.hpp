/// \file The exceptions that firn throws. Their messages say what was given, what is allowed and what to do.
#pragma once

#include <firn/core/requirements.hpp>

#include <charconv>
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>

// Not in the build's namespace: a file may catch what a file of another build throws.
namespace firn {  // whatever the build

/// Base of every exception that firn throws.
struct error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Thrown if a parameter is outside its allowed range (a negative density, ν ≥ ½, a NaN).
struct parameter_error : error {
    using error::error;
};

/// Thrown if an array would need more memory than is available.
struct memory_error : parameter_error {
    using parameter_error::parameter_error;
};

/// Thrown if a particle has values that are not finite, or lies or moves outside the domain.
struct particle_error : error {
    using error::error;
};

/// Thrown if the sums at the nodes of the grid could exceed the range of the fixed-point integers that store them.
struct overflow_error : error {
    using error::error;
};

/// Thrown if a triangle mesh cannot be used, e.g. because it is empty, is not watertight, or has invalid indices.
struct mesh_error : error {
    using error::error;
};

/// Thrown if a file cannot be read or written.
struct io_error : error {
    using error::error;
};

/// Thrown if a GPU does not exist, is lost, or refuses a program or a command.
struct device_error : error {
    using error::error;
};

/// Thrown if a function is called when this is not allowed, e.g. before a function that has to be called first.
struct usage_error : error {
    using error::error;
};

}  // namespace firn

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns a number with at most `digits` significant digits, as C's "%.*g" writes it where no locale is set. Unlike
/// C's functions and C++'s streams, std::to_chars does not know of locales: a program that sets one with a decimal
/// comma writes the same states and messages.
[[gnu::cold]] inline std::string rounded_text(double number, int digits) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, number, std::chars_format::general, digits).ptr};
}

/// Returns the shortest text from which exactly `number` is read again.
[[gnu::cold]] inline std::string exact_text(double number) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, number).ptr};
}

/// Returns exact_text(number), or rounded_text(number, 9).
[[gnu::cold]] inline std::string number_text(double number, bool exactly) {
    return exactly ? exact_text(number) : rounded_text(number, 9);
}

/// One argument of sentence(): a text or a number. All arguments are converted to this type, so that a single function
/// can join the parts of every sentence.
class Part {
public:
    Part(const char* text) : Part(std::string_view(text)) {}
    Part(const std::string& text) : Part(std::string_view(text)) {}
    Part(std::string_view text) : kind_(Kind::text), text_(text) {}
    Part(const char& letter) : Part(std::string_view(&letter, 1)) {}
    template <std::integral I>
    Part(I number) : kind_(std::signed_integral<I> ? Kind::integer : Kind::natural), integer_(std::int64_t(number)) {}
    template <std::floating_point S>
    Part(S number) : kind_(Kind::number), number_(double(number)) {}

    void append_to(std::string& sentence) const {
        if (kind_ == Kind::text) {
            sentence.append(text_.data(), text_.size());
            return;
        }
        sentence += kind_ == Kind::number    ? rounded_text(number_, 9)
                    : kind_ == Kind::integer ? std::to_string(integer_)
                                             : std::to_string(std::uint64_t(integer_));
    }

private:
    enum class Kind { text, number, integer, natural } kind_;
    union {
        std::string_view text_;
        double number_;
        std::int64_t integer_;
    };
};

/// Converts an argument of sentence() to a type from which a Part can be made: a path as a text in quotes, a
/// std::atomic as its value, and any other argument unchanged.
/// @{
template <class T>
    requires requires(const T& path) { path.root_directory(); }
std::string part_of(const T& path) {
    std::string text = "\"";
    for (const char c : path.string()) {
        if (c == '"' || c == '\\') text += '\\';
        text += c;
    }
    return text += '"';
}
template <class T>
    requires requires(const T& atomic) { atomic.load(); }
auto part_of(const T& atomic) {
    return atomic.load();
}
template <class T>
const T& part_of(const T& part) {
    return part;
}
/// @}

[[gnu::cold]] inline std::string joined(std::initializer_list<Part> parts) {
    std::string sentence;
    for (const Part& part : parts) part.append_to(sentence);
    return sentence;
}

/// Returns the components of a point as text: "(x, y, z)".
[[gnu::cold]] inline std::string point_text(const double* x, int dimension) {
    std::string text = "(";
    for (int a = 0; a < dimension; ++a) {
        if (a > 0) text.append(", ", 2);
        Part(x[a]).append_to(text);
    }
    text.append(")", 1);
    return text;
}

}  // namespace detail

/// Joins texts, numbers and paths to one message: `throw parameter_error(sentence("dt = ", dt, " s …"))`.
/// Floating-point numbers are written with up to nine significant digits, and paths are written in quotes.
template <class... Parts>
[[gnu::cold, gnu::noinline]] std::string sentence(const Parts&... parts) {
    return detail::joined({detail::Part(detail::part_of(parts))...});
}

}  // namespace firn::inline FIRN_BUILD
