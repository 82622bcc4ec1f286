/// \file JSON (RFC 8259): any text comes back as it was; escapes mean what section 7 says; what is broken is refused.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/core/json.hpp>

#include <limits>

using namespace firn;

namespace json_tests {
namespace {

std::string read_text(std::string_view json) {
    JsonReader reader(json);
    const std::string text = reader.string();
    if (!reader.at_end()) reader.fail("the end");
    return text;
}

}  // namespace

TEST_CASE("Every byte of a text comes back from JSON, control characters among them", "[core][json]") {
    std::string all;
    for (int c = 0; c < 128; ++c) all += char(c);
    all += "\u00e9\U0001f600";
    Json json;
    json.value(all);
    for (const char c : json.text()) CHECK((static_cast<unsigned char>(c) >= 0x20));  // RFC 8259: they are escaped
    CHECK(read_text(json.text()) == all);
    CHECK(detail::json_text("a\"b\\c\n\x01") == R"("a\"b\\c\u000a\u0001")");
}

TEST_CASE("Escapes of other writers are read", "[core][json]") {
    CHECK(read_text(R"("\"\\\/\b\f\n\r\t")") == "\"\\/\b\f\n\r\t");
    CHECK(read_text(R"("\u0041\u00e9\u20aC\uD83D\ude00!")") == "A\u00e9\u20ac\U0001f600!");  // UTF-8
    for (const char* wrong : {R"("\x41")", R"("\u12")", R"("\u12g4")", R"("\u+123")", R"("\ud83d")", R"("\ud83d\n")",
                              R"("\ud83dA")", R"("\ud83d\u0041")", R"("\ude00")", R"("\)", R"("\u)", R"("a)"})
        CHECK_THROWS_AS(read_text(wrong), io_error);
}

TEST_CASE("Numbers come back as they were; what is not finite is null", "[core][json]") {
    for (const double x : {0.1, -1.0 / 3, 5e-324, 1.7976931348623157e308, 123456789.0})
        CHECK(JsonReader(detail::json_number(x)).number() == x);
    CHECK(detail::json_number(0.1F) == "0.1");
    CHECK(detail::json_number(std::numeric_limits<float>::infinity()) == "null");
    CHECK(detail::json_number(std::uint64_t(-1)) == "18446744073709551615");
}

TEST_CASE("Objects and lists are indented, and stepped over", "[core][json]") {
    Json json;
    json.object([&] {
        json.field("name", "firn").field("good", true);
        json.key("ids").array(std::vector<int>{1, 2}, [&](int id) { json.value(id); });
        json.key("none").array(std::vector<int>{}, [&](int id) { json.value(id); });
    });
    CHECK(json.text() ==
          "{\n  \"name\": \"firn\",\n  \"good\": true,\n  \"ids\": [\n    1,\n    2],\n  \"none\": []\n}");
    JsonReader reader(json.text());
    int members = 0;
    reader.object([&](const std::string&) {
        reader.skip_value();
        ++members;
    });
    CHECK(members == 4);
    CHECK(reader.at_end());
}

}  // namespace json_tests
