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

/// Thrown if the equations of an implicit step are not solved. The particles are those before the step.
struct convergence_error : error {
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

/// One argument of sentence(), in eight bytes: a number, or the address of a text.
union PartOfSentence {
    const char* text;
    const std::string* string;
    const std::string_view* view;
    double number;
    std::int64_t integer;
};
enum class PartKind : char { text, string, view, letter, integer, natural, number, path };

template <PartKind Kind>
struct Part {
    PartOfSentence value;
    static constexpr PartKind kind = Kind;
};

/// Converts an argument of sentence() to a Part.
/// @{
[[gnu::always_inline]] inline Part<PartKind::text> part(const char* text) { return {{.text = text}}; }
[[gnu::always_inline]] inline Part<PartKind::string> part(const std::string& text) { return {{.string = &text}}; }
[[gnu::always_inline]] inline Part<PartKind::view> part(const std::string_view& text) { return {{.view = &text}}; }
[[gnu::always_inline]] inline Part<PartKind::letter> part(char letter) { return {{.integer = letter}}; }
template <std::signed_integral I>
[[gnu::always_inline]] inline Part<PartKind::integer> part(I number) {
    return {{.integer = number}};
}
template <std::unsigned_integral I>
[[gnu::always_inline]] inline Part<PartKind::natural> part(I number) {
    return {{.integer = std::int64_t(number)}};
}
template <std::floating_point S>
[[gnu::always_inline]] inline Part<PartKind::number> part(S number) {
    return {{.number = double(number)}};
}
template <class T>
    requires requires(const T& path) { path.root_directory(); }
[[gnu::always_inline]] inline Part<PartKind::path> part(const T& path) {
    return {{.string = &path.native()}};
}
template <class T>
    requires requires(const T& atomic) { atomic.load(); }
[[gnu::always_inline]] inline auto part(const T& atomic) {
    return part(atomic.load());
}
/// @}

/// The kinds of a sentence's parts, in their order. They are known when a call is compiled, and need no code there.
template <PartKind... Kinds>
inline constexpr PartKind part_kinds[] = {Kinds...};

[[gnu::cold, gnu::noinline]] inline std::string joined(std::initializer_list<PartOfSentence> parts,
                                                       const PartKind* kind) {
    std::string sentence;
    for (const PartOfSentence& each : parts) switch (*kind++) {
            case PartKind::text:
                sentence += each.text;
                break;
            case PartKind::string:
                sentence += *each.string;
                break;
            case PartKind::view:
                sentence += *each.view;
                break;
            case PartKind::letter:
                sentence += char(each.integer);
                break;
            case PartKind::integer:
                sentence += std::to_string(each.integer);
                break;
            case PartKind::natural:
                sentence += std::to_string(std::uint64_t(each.integer));
                break;
            case PartKind::number:
                sentence += rounded_text(each.number, 9);
                break;
            case PartKind::path:
                sentence += '"';
                for (const char c : *each.string) {
                    if (c == '"' || c == '\\') sentence += '\\';
                    sentence += c;
                }
                sentence += '"';
        }
    return sentence;
}

/// Returns the components of a point as text: "(x, y, z)".
[[gnu::cold]] inline std::string point_text(const double* x, int dimension) {
    std::string text = "(";
    for (int a = 0; a < dimension; ++a) {
        if (a > 0) text.append(", ", 2);
        text += rounded_text(x[a], 9);
    }
    text.append(")", 1);
    return text;
}

}  // namespace detail

/// Joins texts, numbers and paths to one message: `throw parameter_error(sentence("dt = ", dt, " s …"))`.
/// Floating-point numbers are written with up to nine significant digits, and paths are written in quotes.
template <class... Parts>
[[gnu::always_inline]] inline std::string sentence(const Parts&... parts) {
    return detail::joined({detail::part(parts).value...}, detail::part_kinds<decltype(detail::part(parts))::kind...>);
}

}  // namespace firn::inline FIRN_BUILD
