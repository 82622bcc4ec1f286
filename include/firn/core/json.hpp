/// \file JSON (RFC 8259): a writer, and a reader that steps over what its caller does not know.
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

namespace firn {

namespace detail {

/// In quotes; quotes, backslashes and control characters escaped (RFC 8259, section 7).
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

/// The shortest decimal that reads back as the same number; null if it is not finite, for which JSON has none.
template <class T>
    requires std::is_arithmetic_v<T>
std::string json_number(T value) {
    if constexpr (std::floating_point<T>)
        if (!std::isfinite(value)) return "null";
    char digits[32];
    return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

}  // namespace detail

/// Writes one value, indented by two spaces a level: json.object([&] { json.field("steps", 3).key("ids").array(…); }).
class Json {
public:
    template <class Body>
    Json& object(const Body& body) {
        return enclosed('{', '}', body);
    }
    template <class Range, class F>
    Json& array(const Range& range, const F& f) {
        return enclosed('[', ']', [&] {
            for (const auto& each : range) {
                separate();
                f(each);
            }
        });
    }
    Json& key(const char* name) {
        separate();
        text_ += detail::json_text(name);
        text_ += ": ";
        return *this;
    }
    template <class T>
    Json& field(const char* name, const T& of) {
        return key(name).value(of);
    }
    Json& value(const char* of) { return value(std::string_view(of)); }
    Json& value(const std::string& of) { return value(std::string_view(of)); }
    Json& value(std::string_view of) {
        text_ += detail::json_text(of);
        return *this;
    }
    /// \see json_number
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

/// Reads what its caller asks for, in the order of the text. \throws io_error  with the byte where it is otherwise
class JsonReader {
public:
    explicit JsonReader(std::string_view text) : text_(text) {}

    /// Whether the next sign is c; steps over it.
    bool take(char c) {
        skip_space();
        if (at_ >= text_.size() || text_[at_] != c) return false;
        ++at_;
        return true;
    }
    void expect(char c) {
        if (!take(c)) fail(sentence("'", c, "'"));
    }
    bool at_end() {
        skip_space();
        return at_ == text_.size();
    }

    std::string string() {
        expect('"');
        std::string value;
        for (; at_ < text_.size() && text_[at_] != '"'; ++at_) {
            if (text_[at_] == '\\')
                append_escaped(value);
            else
                value += text_[at_];
        }
        expect('"');
        return value;
    }

    double number() {
        skip_space();
        double value = 0;
        const auto [end, failure] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
        if (failure != std::errc{} || !std::isfinite(value)) fail("a finite number");
        at_ = std::size_t(end - text_.data());
        return value;
    }

    /// f(key) reads each member's value.
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

    template <class F>
    void array(const F& f) {
        expect('[');
        if (take(']')) return;
        do f();
        while (take(','));
        expect(']');
    }

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

    [[noreturn]] void fail(std::string_view expected) const {
        throw io_error(sentence("byte ", at_, ": expected ", expected));
    }

private:
    /// What the backslash at at_ begins; at_ is then at its last sign.
    void append_escaped(std::string& value) {
        constexpr std::string_view signs = "\"\\/bfnrt", meant = "\"\\/\b\f\n\r\t";
        ++at_;
        const std::size_t sign = at_ < text_.size() ? signs.find(text_[at_]) : std::string_view::npos;
        if (sign != std::string_view::npos) return void(value += meant[sign]);
        if (at_ >= text_.size() || text_[at_] != 'u') fail("one of \" \\ / b f n r t u after a backslash");
        std::uint32_t code = four_digits();
        if (code >= 0xd800 && code < 0xdc00) {  // the first half of a pair
            at_ += 1;
            if (text_.substr(at_, 2) != "\\u") fail("the second half of a pair, \\udc00 to \\udfff");
            ++at_;
            const std::uint32_t low = four_digits();
            if (low < 0xdc00 || low > 0xdfff) fail("the second half of a pair, \\udc00 to \\udfff");
            code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
        } else if (code >= 0xdc00 && code < 0xe000) {
            fail("the first half of a pair, \\ud800 to \\udbff, before its second");
        }
        const auto tail = [&](int shift) { value += char(0x80 | (code >> shift & 0x3f)); };
        if (code < 0x80) {
            value += char(code);
        } else if (code < 0x800) {
            value += char(0xc0 | code >> 6);
            tail(0);
        } else if (code < 0x10000) {
            value += char(0xe0 | code >> 12);
            tail(6), tail(0);
        } else {
            value += char(0xf0 | code >> 18);
            tail(12), tail(6), tail(0);
        }
    }
    /// The four hexadecimal digits behind the u at at_; at_ is then at the last.
    std::uint32_t four_digits() {
        std::uint32_t code = 0;
        const std::string_view digits = text_.substr(at_ + 1, 4);
        const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
        if (digits.size() < 4 || failure != std::errc{} || end != digits.data() + 4) fail("four digits after \\u");
        at_ += 4;
        return code;
    }
    void skip_space() {
        while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
    }

    std::string_view text_;
    std::size_t at_ = 0;
};

}  // namespace firn
