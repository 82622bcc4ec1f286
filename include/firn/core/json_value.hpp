/// \file JSON text as a tree of values, each of which knows its line: for files that people write.
#pragma once

#include <firn/core/json.hpp>
#include <firn/core/tensor.hpp>

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A value of a JSON text. A function that reads a value as what it is not throws io_error. The message begins with the
/// line and the name of the value: "line 12, cell_size: …".
class JsonValue {
public:
    /// What a value is.
    enum class Kind : std::uint8_t { null, truth, number, text, array, object };

    /// Reads a text.
    /// \throws io_error  if it is not valid JSON (RFC 8259), if a member is there twice, or if more than 16 levels of
    ///                   objects and arrays enclose a value
    static JsonValue parse(std::string_view text) {
        JsonReader reader(text);
        Lines lines{text};
        try {
            JsonValue value = read(reader, lines, "the file", 0);
            if (!reader.at_end()) reader.fail("the end of the text");
            return value;
        } catch (const Mistake& mistake) {
            throw io_error(mistake.what());
        } catch (const io_error& mistake) {
            throw io_error(sentence("line ", lines.line_of(reader.position()), ": ", mistake.what()));
        }
    }

    Kind kind() const { return kind_; }                    ///< Returns what the value is.
    int line() const { return line_; }                     ///< Returns the line where the value begins, from 1.
    const std::string& name() const { return name_; }      ///< Returns the name of the member; "NAME[2]" in an array.
    bool is(Kind kind) const { return kind_ == kind; }     ///< Returns whether the value is of this kind.
    std::size_t size() const { return elements_.size(); }  ///< Returns the number of elements or members.
    auto begin() const { return elements_.begin(); }       ///< Returns an iterator to the first element or member.
    auto end() const { return elements_.end(); }           ///< Returns the end of the elements or members.

    /// Returns the number. \throws io_error  if the value is none
    double number() const {
        if (!is(Kind::number)) fail("give a number");
        return number_;
    }
    /// Returns the number, which must be whole and not negative.
    /// \throws io_error  if the value is no such number
    std::uint64_t whole() const {
        constexpr double most = 9007199254740992.0;  // 2⁵³
        if (!is(Kind::number) || !(number_ >= 0 && number_ <= most) || number_ != double(std::uint64_t(number_)))
            fail("give a whole number, 0 or more");
        return std::uint64_t(number_);
    }
    /// Returns the text. \throws io_error  if the value is none
    const std::string& text() const {
        if (!is(Kind::text)) fail("give a text in quotes");
        return text_;
    }
    /// Returns true or false. \throws io_error  if the value is neither
    bool truth() const {
        if (!is(Kind::truth)) fail("give true or false");
        return number_ != 0;
    }
    /// Returns D numbers. \throws io_error  if the value is no array of D numbers
    template <int D>
    Vec<double, D> vector() const {
        if (!is(Kind::array) || size() != std::size_t(D)) fail(sentence("give ", D, " numbers in brackets"));
        Vec<double, D> numbers{};
        for (int a = 0; a < D; ++a) numbers[a] = elements_[std::size_t(a)].number();
        return numbers;
    }
    /// Returns the value as an array. \throws io_error  if it is none
    const JsonValue& array() const {
        if (!is(Kind::array)) fail("give an array, [ … ]");
        return *this;
    }
    /// Returns the value as an object. \throws io_error  if it is none
    const JsonValue& object() const {
        if (!is(Kind::object)) fail("give an object, { … }");
        return *this;
    }
    /// Returns the member of this name; nullptr if the object has none.
    /// \throws io_error  if the value is no object
    const JsonValue* find(std::string_view member) const {
        for (const JsonValue& one : object())
            if (one.name_ == member) return &one;
        return nullptr;
    }
    /// Returns the member of this name. \throws io_error  if the object has none
    const JsonValue& at(std::string_view member) const {
        const JsonValue* const found = find(member);
        if (!found) fail(sentence("'", member, "' is missing"));
        return *found;
    }
    /// Checks that the object has no members but these.
    /// \throws io_error  if it has another one; the message lists those that it may have
    void allow(std::initializer_list<std::string_view> members) const {
        for (const JsonValue& one : object())
            if (std::find(members.begin(), members.end(), one.name_) == members.end()) {
                std::string all;
                for (const std::string_view name : members) (all += all.empty() ? "" : ", ") += name;
                one.fail("there is no such member here; there are: " + all);
            }
    }
    /// Returns f(). If f() throws parameter_error or mesh_error, the error gets the line of this value, or of the
    /// member that the error names.
    /// \throws io_error  in place of them
    template <class F>
    auto checked(const F& f) const {
        try {
            return f();
        } catch (const parameter_error& wrong) {
            blamed(wrong.what()).fail(wrong.what());
        } catch (const mesh_error& wrong) {
            blamed(wrong.what()).fail(wrong.what());
        }
    }
    /// Reports a mistake in this value. \throws io_error  always
    [[noreturn]] void fail(std::string_view what) const {
        throw Mistake(sentence("line ", line_, ", ", name_, ": ", what));
    }

private:
    /// An error that tells its line already.
    struct Mistake : io_error {
        using io_error::io_error;
    };
    struct Lines {
        std::string_view text;

        int line_of(std::size_t position) const {
            return 1 +
                   int(std::count(text.begin(), text.begin() + std::ptrdiff_t(std::min(position, text.size())), '\n'));
        }
    };

    /// Returns the member that a message names, the one with the longest name; this value if none is named.
    const JsonValue& blamed(std::string_view message) const {
        const JsonValue* found = this;
        std::size_t longest = 0;
        if (!is(Kind::object)) return *this;
        for (const JsonValue& one : elements_) {
            std::string words = one.name_;
            std::replace(words.begin(), words.end(), '_', ' ');
            words = ' ' + words + ' ';
            if (words.size() > longest && message.find(words) != std::string_view::npos) {
                longest = words.size();
                found = &one;
            }
        }
        return *found;
    }
    static JsonValue read(JsonReader& reader, const Lines& lines, std::string name, int depth) {
        JsonValue value;
        value.name_ = std::move(name);
        const std::size_t at = reader.position();
        value.line_ = lines.line_of(at);
        if (depth > 16) value.fail("too many brackets enclose this");
        const char c = at < lines.text.size() ? lines.text[at] : '\0';
        if (c == '{') {
            value.kind_ = Kind::object;
            reader.object([&](const std::string& key) {
                JsonValue member = read(reader, lines, key, depth + 1);
                if (value.find(key)) member.fail("this member is there twice");
                value.elements_.push_back(std::move(member));
            });
        } else if (c == '[') {
            value.kind_ = Kind::array;
            reader.array([&] {
                value.elements_.push_back(
                    read(reader, lines, sentence(value.name_, "[", value.elements_.size(), "]"), depth + 1));
            });
        } else if (c == '"') {
            value.kind_ = Kind::text;
            value.text_ = reader.string();
        } else if (c == 't' || c == 'f' || c == 'n') {
            const std::string_view rest = lines.text.substr(at);
            value.kind_ = c == 'n' ? Kind::null : Kind::truth;
            value.number_ = rest.substr(0, 4) == "true";
            reader.skip_value();
        } else {
            value.kind_ = Kind::number;
            value.number_ = reader.number();
        }
        return value;
    }

    Kind kind_ = Kind::null;
    int line_ = 0;
    double number_ = 0;
    std::string name_, text_;
    std::vector<JsonValue> elements_;
};

}  // namespace firn::inline FIRN_BUILD
