/// \file Writes JSON.
#pragma once

#include <firn/core/requirements.hpp>

#include <charconv>
#include <cmath>
#include <concepts>
#include <string>
#include <string_view>

namespace firn::wgsl {

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
        quote(name);
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
        quote(of);
        return *this;
    }
    /// Read back as the same double; null if it is not finite, for which JSON has no number.
    template <class T>
        requires std::is_arithmetic_v<T> && (!std::same_as<T, bool>)
    Json& value(T of) {
        if constexpr (std::floating_point<T>)
            if (!std::isfinite(of)) {
                text_ += "null";
                return *this;
            }
        char digits[32];
        text_.append(digits, std::to_chars(digits, digits + sizeof digits, of).ptr);
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
    void quote(std::string_view of) {
        text_ += '"';
        for (const char c : of) {
            if (c == '"' || c == '\\') text_ += '\\';
            if (static_cast<unsigned char>(c) < 0x20)
                text_ += ' ';
            else
                text_ += c;
        }
        text_ += '"';
    }

    std::string text_;
    int depth_ = 0;
    bool first_ = true;
};

}  // namespace firn::wgsl
