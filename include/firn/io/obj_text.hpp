/// \file Parses the text of a Wavefront OBJ file: its vertices, and its faces as polygons.
///
/// Format: Alias|Wavefront, "Object Files (.obj)", appendix B1 of the Advanced Visualizer manual, version 3.0.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// What the text of an OBJ file says. A line that cannot be understood is an error that gives its number.
///
/// Lines end with LF, CR LF or CR. A comment (#) may follow data. A line that ends with a backslash goes on in the next
/// line. Blanks, tabs, form feeds and vertical tabs separate words. A mark of UTF-8 at the beginning is skipped.
class ObjText {
public:
    struct Face {
        std::size_t first;  ///< index of the face's first corner in `corners`; the corners of the next face follow
        std::int64_t line;  ///< number of the line, counted from 1
    };

    /// \throws io_error  if a line is malformed, or if the text is not in UTF-8
    ObjText(const std::filesystem::path& path, std::string_view text)
        : path_(path), at_(text.data()), end_(text.data() + text.size()) {
        check_encoding(text);
        if (text.starts_with("\xEF\xBB\xBF")) at_ += 3;
        while (at_ != end_) parse_statement();
        if (highest_ > std::int64_t(vertices.size())) {
            first_line_ = highest_line_;
            refuse(sentence("names vertex ", highest_, ", but the file has ", vertices.size(), " vertices"));
        }
    }

    std::vector<Vec<double, 3>> vertices;
    std::vector<std::int32_t> corners;  ///< indices of vertices, counted from 0, face after face
    std::vector<Face> faces;
    std::size_t free_form = 0;  ///< number of free-form surfaces and patches, which are skipped

    /// Returns the corners of the face with the index `face`.
    std::span<const std::int32_t> corners_of(std::size_t face) const {
        const std::size_t end = face + 1 < faces.size() ? faces[face + 1].first : corners.size();
        return std::span(corners).subspan(faces[face].first, end - faces[face].first);
    }

private:
    /// Keywords of the format that are skipped, besides vt and vn: those of groups, materials, lines, points and
    /// free-form geometry. "csh" would run a command of the shell.
    static constexpr std::string_view skipped[] = {
        "l",     "g",   "s",   "usemtl", "o",     "p",    "mtllib",     "mg",        "usemap", "maplib",
        "bevel", "lod", "deg", "cstype", "bmat",  "step", "parm",       "trim",      "hole",   "scrv",
        "sp",    "end", "con", "curv",   "curv2", "surf", "c_interp",   "d_interp",  "ctech",  "stech",
        "csh",   "bsp", "bzp", "cdc",    "cdp",   "res",  "shadow_obj", "trace_obj", "vp"};

    [[noreturn]] void refuse(const std::string& what) const {
        throw io_error(sentence("Line ", first_line_, " of ", path_, " ", what, ". Correct the file."));
    }

    void check_encoding(std::string_view text) const {
        const auto begins = text.substr(0, 4);
        if (!begins.starts_with("\xFF\xFE") && !begins.starts_with("\xFE\xFF") &&
            begins.find('\0') == std::string_view::npos)
            return;
        throw io_error(sentence(path_,
                                " is no text in UTF-8: it begins as a text in UTF-16 or UTF-32 does, or as a binary "
                                "file. Save it as UTF-8 or ASCII."));
    }

    /// Returns a word for a message: its first 40 bytes, where what cannot be printed is given in hexadecimal digits.
    static std::string shown(std::string_view word) {
        constexpr std::size_t most = 40;
        constexpr char digits[] = "0123456789abcdef";
        std::string text;
        for (const char c : word.substr(0, most)) {
            const auto byte = static_cast<unsigned char>(c);
            if (byte > ' ' && byte < 0x7f)
                text += c;
            else
                text.append("\\x").append({digits[byte >> 4], digits[byte & 15]});
        }
        return word.size() > most ? text + "..." : text;
    }

    static bool is_line_end(char c) { return c == '\n' || c == '\r'; }
    static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\f' || c == '\v'; }
    /// Whether the character at `at` is a backslash at the end of a line.
    bool continues(const char* at) const { return *at == '\\' && at + 1 != end_ && is_line_end(at[1]); }

    void pass_line_end() {
        if (end_ - at_ > 1 && at_[0] == '\r' && at_[1] == '\n') ++at_;
        ++at_;
        ++line_;
    }

    /// Returns the next word of the statement; empty at its end.
    std::string_view next_word() {
        while (at_ != end_ && (is_blank(*at_) || continues(at_)))
            if (*at_++ == '\\') pass_line_end();
        const char* const begin = at_;
        while (at_ != end_ && !is_blank(*at_) && !is_line_end(*at_) && *at_ != '#' && !continues(at_)) ++at_;
        return {begin, std::size_t(at_ - begin)};
    }

    /// Goes to the next line. Returns whether this one ends with a backslash.
    bool skip_line() {
        const char* const begin = at_;
        while (at_ != end_ && !is_line_end(*at_)) ++at_;
        const bool continued = at_ != begin && at_[-1] == '\\';
        if (at_ != end_) pass_line_end();
        return continued;
    }

    void parse_statement() {
        first_line_ = line_;
        const auto keyword = next_word();
        bool skips = false;
        if (keyword == "v")
            parse_vertex();
        else if (keyword == "f" || keyword == "fo")  // "fo", face outline: an older name
            parse_face();
        else if (!keyword.empty())
            skips = skip(keyword);
        // A name or a path may end with a backslash. So if a statement goes on that is skipped, the next line is
        // skipped only if it does not begin with a keyword.
        skipped_goes_on_ = skip_line() && skips;
    }

    /// Returns true; throws an error if the statement may not be skipped.
    bool skip(std::string_view keyword) {
        if (keyword == "vt") return ++textures_ > 0;
        if (keyword == "vn") return ++normals_ > 0;
        if (keyword == "call")
            refuse("takes in another file (call), which firn does not read; put its lines in place of this one");
        if (std::find(std::begin(skipped), std::end(skipped), keyword) == std::end(skipped)) {
            if (skipped_goes_on_) return true;
            refuse(
                sentence("has the keyword \"", shown(keyword),
                         "\", which the format does not have; vertices begin with v, faces with f, comments with #"));
        }
        free_form += keyword == "surf" || keyword == "bsp" || keyword == "bzp";
        return true;
    }

    /// Returns the word without a plus in front, for std::from_chars.
    static std::string_view without_plus(std::string_view word) {
        const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
        return word.substr(plus ? 1 : 0);
    }

    /// Of a decimal number that is outside the range of `double`, returns whether it is nearer to 0.
    static bool is_tiny(std::string_view digits) {
        const auto mark = std::min(digits.find_first_of("eE"), digits.size());
        const auto mantissa = digits.substr(0, mark);
        const auto point = std::min(mantissa.find('.'), mantissa.size());
        std::int64_t exponent = 0;
        if (mark < digits.size()) {
            const auto power = without_plus(digits.substr(mark + 1));
            const auto code = std::from_chars(power.data(), power.data() + power.size(), exponent).ec;
            if (code != std::errc{}) return power.starts_with('-');  // more digits than fit
            exponent = std::clamp<std::int64_t>(exponent, -(1LL << 60), 1LL << 60);
        }
        const auto first = std::min(mantissa.find_first_of("123456789"), mantissa.size());
        return exponent + std::int64_t(point) - std::int64_t(first) < 0;
    }

    /// Reads a finite number; nothing if the word is none. A number too near to 0 for `double` is 0.
    static std::optional<double> number(std::string_view word) {
        const auto digits = without_plus(word);
        const char* const last = digits.data() + digits.size();
        double x = 0;
        const auto [end, code] = std::from_chars(digits.data(), last, x);
        if (end != last) return {};
        if (code == std::errc::result_out_of_range && is_tiny(digits)) return 0.0;
        if (code != std::errc{} || !std::isfinite(x)) return {};
        return x;
    }

    void parse_vertex() {
        const std::size_t count = vertices.size() + 1;
        if (count > std::size_t(std::numeric_limits<std::int32_t>::max()))
            refuse("has one vertex more than int32 can name");
        Vec<double, 3> x{};
        for (int k = 0; k < 3; ++k) {
            const auto word = next_word();
            if (word.empty()) refuse(sentence("has ", k, " coordinates for vertex ", count, "; three are needed"));
            const auto read = number(word);
            if (!read)
                refuse(sentence("has the coordinate \"", shown(word), "\" for vertex ", count,
                                "; a finite number is needed"));
            x[k] = *read;
        }
        for (auto word = next_word(); !word.empty(); word = next_word())  // a weight or a colour
            if (!number(word))
                refuse(sentence("has \"", shown(word), "\" after the coordinates of vertex ", count,
                                "; only finite numbers may follow, and a comment after #"));
        vertices.push_back(x);
    }

    static std::optional<std::int64_t> whole_number(std::string_view word) {
        const auto digits = without_plus(word);
        const char* const last = digits.data() + digits.size();
        std::int64_t index = 0;
        const auto [end, code] = std::from_chars(digits.data(), last, index);
        if (code != std::errc{} || end != last) return {};
        return index;
    }

    void check_back(std::int64_t index, std::int64_t count, const char* what) const {
        if (index >= -count) return;
        const auto back = -std::uint64_t(index);  // correct also for the lowest std::int64_t
        refuse(sentence("has a face that counts back by ", back, " ", what, ", of ", count, " so far"));
    }

    /// Reads the corner `vertex`, `vertex/texture`, `vertex//normal` or `vertex/texture/normal`.
    void parse_corner(std::string_view word) {
        const auto length = std::min(word.find('/'), word.size());
        const auto index = whole_number(word.substr(0, length));
        if (!index || *index == 0)
            refuse(sentence("has a face with the vertex index \"", shown(word),
                            "\"; indices are whole numbers from 1, or negative ones that count back"));
        const auto count = std::int64_t(vertices.size());
        check_back(*index, count, "vertices");
        auto rest = word.substr(length);
        for (int k = 0; !rest.empty(); ++k) {
            rest.remove_prefix(1);
            const auto other = rest.substr(0, rest.find('/'));
            rest.remove_prefix(other.size());
            const auto read = whole_number(other);
            if (k == 2 || (!read && !other.empty()))
                refuse(sentence("has a face with the corner \"", shown(word),
                                "\"; a corner is vertex, vertex/texture, vertex//normal or vertex/texture/normal"));
            if (read) check_back(*read, k == 0 ? textures_ : normals_, k == 0 ? "texture coordinates" : "normals");
        }
        const auto vertex = *index > 0 ? *index : count + 1 + *index;
        if (vertex > highest_) {
            highest_ = vertex;
            highest_line_ = first_line_;
        }
        // A face may come before its vertices. An index that no vertex can have is refused at the end of the file;
        // until then, it is not that of another corner.
        const bool can_be = vertex <= std::numeric_limits<std::int32_t>::max();
        corners.push_back(can_be ? std::int32_t(vertex - 1) : -1 - std::int32_t(corners.size() & 0x7fffffff));
    }

    void parse_face() {
        faces.push_back({corners.size(), first_line_});
        for (auto word = next_word(); !word.empty(); word = next_word()) parse_corner(word);
        const auto face = corners_of(faces.size() - 1);
        if (const auto twice = named_twice(face))
            refuse(sentence("has a face that names vertex ", *twice + 1,
                            " twice; a face goes round once, and one with a hole must be cut into several"));
        if (face.size() < 3) refuse(sentence("has a face of ", face.size(), " vertices; three or more are needed"));
    }

    std::optional<std::int64_t> named_twice(std::span<const std::int32_t> face) {
        if (face.size() <= 8) {
            for (std::size_t i = 1; i < face.size(); ++i)
                if (std::find(face.begin(), face.begin() + std::ptrdiff_t(i), face[i]) !=
                    face.begin() + std::ptrdiff_t(i))
                    return face[i];
            return {};
        }
        sorted_.assign(face.begin(), face.end());
        std::sort(sorted_.begin(), sorted_.end());
        const auto twice = std::adjacent_find(sorted_.begin(), sorted_.end());
        return twice == sorted_.end() ? std::nullopt : std::optional<std::int64_t>(*twice);
    }

    const std::filesystem::path& path_;
    const char *at_, *end_;
    std::int64_t line_ = 1, first_line_ = 1;  // number of the line at at_, and of the first line of the statement
    std::int64_t textures_ = 0, normals_ = 0, highest_ = 0, highest_line_ = 0;
    bool skipped_goes_on_ = false;  // true if the line before is skipped and ends with a backslash
    std::vector<std::int32_t> sorted_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
