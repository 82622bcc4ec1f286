/// \file A writer and a reader of JSON (RFC 8259). The reader can skip values that its caller does not know.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>

#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the text as a JSON string: in quotes, with quotes, backslashes and control characters escaped (RFC 8259,
/// section 7).
inline std::string json_text(std::string_view text) {
    constexpr const char* digits = "0123456789abcdef";
    std::string json = "\"";
    for (const char c : text) {
        const auto code = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\')
            (json += '\\') += c;
        else if (code < 0x20)
            ((json += "\\u00") += digits[code >> 4]) += digits[code & 15];
        else
            json += c;
    }
    return json + '"';
}

/// Returns the shortest decimal text from which exactly `value` is read again. If `value` is not finite, returns
/// "null", since JSON cannot express such numbers.
template <class T>
    requires std::is_arithmetic_v<T>
std::string json_number(T value) {
    if constexpr (std::floating_point<T>)
        if (!std::isfinite(value)) return "null";
    char digits[32];
    return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

}  // namespace detail

/// Writes one JSON value, indented by two spaces per level:
///
///     json.object([&] { json.field("steps", 3).key("ids").array(…); });
class Json {
public:
    /// Writes an object. The function body() must write the object's members, with field(), or with key() and a value.
    template <class Body>
    Json& object(const Body& body) {
        return enclosed('{', '}', body);
    }
    /// Writes an array. f(each) is called for each element of the range and must write one value.
    template <class Range, class F>
    Json& array(const Range& range, const F& f) {
        return enclosed('[', ']', [&] {
            for (const auto& each : range) {
                separate();
                f(each);
            }
        });
    }
    /// Writes the key of a member. The next call must write the member's value.
    Json& key(const char* name) {
        separate();
        text_ += detail::json_text(name);
        text_ += ": ";
        return *this;
    }
    /// Writes a member of an object: its key and its value.
    template <class T>
    Json& field(const char* name, const T& of) {
        return key(name).value(of);
    }
    /// Writes a text, a number or a bool. A number that is not finite is written as null.
    /// @{
    Json& value(const char* of) { return value(std::string_view(of)); }
    Json& value(const std::string& of) { return value(std::string_view(of)); }
    Json& value(std::string_view of) {
        text_ += detail::json_text(of);
        return *this;
    }
    template <class T>
        requires std::is_arithmetic_v<T> && (!std::same_as<T, bool>)
    Json& value(T of) {
        text_ += detail::json_number(of);
        return *this;
    }
    Json& value(bool of) {
        text_ += of ? "true" : "false";
        return *this;
    }
    /// @}

    /// Returns the text written so far.
    const std::string& text() const { return text_; }

private:
    template <class Body>
    Json& enclosed(char open, char close, const Body& body) {
        text_ += open;
        ++depth_;
        first_ = true;
        body();
        --depth_;
        if (!first_ && close == '}') new_line();
        first_ = false;
        text_ += close;
        return *this;
    }
    void separate() {
        if (!first_) text_ += ',';
        first_ = false;
        new_line();
    }
    void new_line() { (text_ += '\n').append(std::size_t(2 * depth_), ' '); }

    std::string text_;
    int depth_ = 0;
    bool first_ = true;
};

/// A reader of JSON text. Each function skips white space, and then reads the next part of the text.
///
/// If the next part of the text is not what the function reads, the function throws io_error. Its message tells the
/// position in the text [bytes].
class JsonReader {
public:
    /// Makes a reader of this text. The text must live as long as the reader.
    explicit JsonReader(std::string_view text) : text_(text) {}

    /// If the next character is c, skips that character and returns true; else returns false.
    bool take(char c) {
        skip_space();
        if (at_ >= text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }
    /// Skips the next character, which must be c.
    /// \throws io_error  if the next character is not c
    void expect(char c) {
        if (!take(c)) fail(sentence("'", c, "'"));
    }
    /// Skips white space and returns the position of the next character [bytes].
    std::size_t position() {
        skip_space();
        return at_;
    }
    /// Whether only white space is left.
    bool at_end() {
        skip_space();
        return at_ == text_.size();
    }

    /// Reads a string and replaces escape sequences by the characters that they mean.
    /// \throws io_error  if the next value is not a valid string
    std::string string() {
        expect('"');
        std::string value;
        while (at_ < text_.size() && text_[at_] != '"') {
            const char c = text_[at_++];
            if (c == '\\')
                append_utf8(value, escaped());
            else
                value += c;
        }
        expect('"');
        return value;
    }

    /// Reads a number.
    /// \throws io_error  if the next value is not a finite number
    double number() {
        skip_space();
        double value = 0;
        const auto [end, failure] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
        if (failure != std::errc{} || !std::isfinite(value)) fail("a finite number");
        at_ = std::size_t(end - text_.data());
        return value;
    }

    /// Reads an object. f(key) is called for each member and must read the member's value.
    /// \throws io_error  if the next value is not an object
    template <class F>
    void object(const F& f) {
        expect('{');
        if (take('}')) return;
        do {
            const auto key = string();
            expect(':');
            f(key);
        } while (take(','));
        expect('}');
    }

    /// Reads an array. f() is called for each element and must read that element.
    /// \throws io_error  if the next value is not an array
    template <class F>
    void array(const F& f) {
        expect('[');
        if (take(']')) return;
        do f();
        while (take(','));
        expect(']');
    }

    /// Skips the next value.
    /// \param depth  number of objects and arrays that enclose the value
    /// \throws io_error  if the value is not valid JSON, or if it contains more than 16 levels of objects and arrays
    void skip_value(int depth = 0) {
        if (depth > 16) fail("less nesting");
        skip_space();
        const char c = at_ < text_.size() ? text_[at_] : '\0';
        if (c == '{') return object([&](const std::string&) { skip_value(depth + 1); });
        if (c == '[') return array([&] { skip_value(depth + 1); });
        if (c == '"') return void(string());
        for (const std::string_view word : {"true", "false", "null"}) {
            if (text_.substr(at_, word.size()) == word) return void(at_ += word.size());
        }
        number();
    }

    /// Reports an error at the current position.
    /// \param expected  what the text should contain at this position
    /// \throws io_error  always
    [[noreturn]] void fail(std::string_view expected) const {
        throw io_error(sentence("byte ", at_, ": expected ", expected));
    }

private:
    /// Reads what follows a backslash, and returns the character that it means.
    std::uint32_t escaped() {
        constexpr std::string_view signs = "\"\\/bfnrt", meant = "\"\\/\b\f\n\r\t";
        const char sign = at_ < text_.size() ? text_[at_] : '\0';
        if (const auto found = signs.find(sign); found < signs.size()) return ++at_, std::uint32_t(meant[found]);
        if (sign != 'u') fail("one of \" \\ / b f n r t u after a backslash");
        ++at_;
        const std::uint32_t code = four_digits();
        if (code < 0xd800 || code > 0xdfff) return code;
        if (code >= 0xdc00) fail("the first half of a pair, \\ud800 to \\udbff, before its second");
        std::uint32_t low = 0;
        if (text_.substr(at_, 2) == "\\u") at_ += 2, low = four_digits();
        if (low < 0xdc00 || low > 0xdfff) fail("the second half of a pair, \\udc00 to \\udfff");
        return 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
    }
    std::uint32_t four_digits() {
        std::uint32_t code = 0;
        const std::string_view digits = text_.substr(at_, 4);
        const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
        if (failure != std::errc{} || end != digits.data() + 4) fail("four digits after \\u");
        at_ += 4;
        return code;
    }
    static void append_utf8(std::string& text, std::uint32_t code) {
        int more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;  // bytes after the first
        text += char(more == 0 ? code : (0xff00U >> (more + 1) & 0xff) | code >> (6 * more));
        while (more-- > 0) text += char(0x80 | (code >> (6 * more) & 0x3f));
    }
    void skip_space() {
        while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
    }

    std::string_view text_;
    std::size_t at_ = 0;
};

}  // namespace firn::inline FIRN_BUILD
