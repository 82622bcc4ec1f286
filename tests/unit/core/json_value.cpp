/// \file JSON text as a tree of values with lines.
#include "support/message.hpp"
#include <firn/core/json_value.hpp>

#include <string>

namespace json_value_tests {

using firn::io_error;
using firn::JsonValue;
using test_support::check_refused;

TEST_CASE("JSON values are what the text says, with their lines", "[core]") {
    const auto value = JsonValue::parse(
        "{\"a\": [1, -2.5e3,\n 3],\n\"b\": {\"c\": \"d\\n\"}, \"e\": true, \"f\": null, "
        "\"g\": false}\n");
    CHECK(value.size() == 5);
    CHECK(value.line() == 1);
    CHECK(value.at("a").vector<3>()[1] == -2500);
    CHECK(value.at("a").begin()[2].line() == 2);
    CHECK(value.at("a").begin()[2].name() == "a[2]");
    CHECK(value.at("a").begin()->whole() == 1);
    CHECK(value.at("b").at("c").text() == "d\n");
    CHECK(value.at("b").line() == 3);
    CHECK(value.at("e").truth());
    CHECK(!value.at("g").truth());
    CHECK(value.at("f").is(JsonValue::Kind::null));
    CHECK(value.find("h") == nullptr);
    CHECK(JsonValue::parse("7").number() == 7);
}

TEST_CASE("what is not valid JSON, or of another kind, is refused with its line", "[core]") {
    const auto refuse = [](const std::string& text, const std::string& says) {
        check_refused<io_error>([&] { JsonValue::parse(text); }, says);
    };
    refuse("", "line 1");
    refuse("{\"a\": 1,\n}", "line 2");
    refuse("[1,\n2", "line 2");
    refuse("{\"a\": 1}\n\n1", "line 3");
    refuse("[1, nul]", "line 1");
    refuse("{\"a\": 1,\n\"a\": 2}", "line 2, a: this member is there twice");
    refuse(std::string(20, '['), "too many brackets");
    const auto value = JsonValue::parse("{\"a\":\n1.5, \"b\": -1, \"c\": [1, 2], \"d\": {}}");
    check_refused<io_error>([&] { value.at("a").text(); }, "line 2, a: give a text");
    check_refused<io_error>([&] { value.at("a").whole(); }, "a whole number");
    check_refused<io_error>([&] { value.at("b").whole(); }, "a whole number");
    check_refused<io_error>([&] { value.at("a").truth(); }, "true or false");
    check_refused<io_error>([&] { value.at("a").array(); }, "an array");
    check_refused<io_error>([&] { value.at("c").object(); }, "an object");
    check_refused<io_error>([&] { value.at("c").number(); }, "a number");
    check_refused<io_error>([&] { value.at("c").vector<3>(); }, "3 numbers");
    check_refused<io_error>([&] { value.at("e"); }, "'e' is missing");
    check_refused<io_error>([&] { value.allow({"a", "b"}); }, "c: there is no such member here; there are: a, b");
    check_refused<io_error>([&] { value.checked([]() -> int { throw firn::parameter_error("The b is bad."); }); },
                            "line 2, b: The b is bad.");
}

}  // namespace json_value_tests
