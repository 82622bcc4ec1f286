/// \file What is put into the text of a program: every name once, in any order; a name that is not known is refused.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/wgsl/text.hpp>

using namespace firn;

TEST_CASE("Names are put in at one go, whatever their order and whatever they begin with", "[wgsl]") {
    const wgsl::detail::Names names{{"D", "3"}, {"DEPTH", "${D}"}, {"NODE", ""}};
    const wgsl::detail::Names back(names.rbegin(), names.rend());
    for (const auto& all : {names, back}) {
        CHECK(wgsl::detail::replaced("vec${D}u at ${DEPTH}${NODE};", all) == "vec3u at ${D};");
        CHECK(wgsl::detail::replaced("$D }{ $ {D}", all) == "$D }{ $ {D}");
        CHECK(wgsl::detail::replaced("", all).empty());
    }
}

TEST_CASE("A name that nothing is put in for is refused", "[wgsl]") {
    const wgsl::detail::Names names{{"D", "3"}};
    test_support::check_refused<usage_error>([&] { wgsl::detail::replaced("a ${DEEP} b", names); }, "${DEEP}");
    test_support::check_refused<usage_error>([&] { wgsl::detail::replaced("a ${D", names); }, "${D}");
}
