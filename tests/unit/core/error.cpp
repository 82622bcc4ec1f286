// Numbers in messages and files.
#include "support/catch.hpp"
#include <firn/core/error.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

using namespace firn;

namespace error_tests {

TEST_CASE("Numbers are written as C writes them without a locale, and exactly where that is asked for") {
    // Texts in states are compared and hashed: they have the bytes of C's "%.9g", with which firn once wrote them.
    std::mt19937_64 random(1);
    std::vector<double> numbers{0.0,         -0.0, 1.0 / 3,     0.1,   1e-5,   1e-4,
                                123456789.5, 1e9,  999999999.9, 1e300, 5e-324, 1234567};
    for (const double limit : {std::numeric_limits<double>::infinity(), std::nan("")})
        numbers.insert(numbers.end(), {limit, -limit});
    for (int i = 0; i < 20000; ++i) {
        numbers.push_back(std::bit_cast<double>(random()));
        numbers.push_back(std::ldexp(double(random() >> 44), int(random() % 60) - 40));
    }
    int wrong = 0;
    for (const double x : numbers) {
        char text[40];
        for (const int digits : {3, 6, 9, 16}) {
            std::snprintf(text, sizeof text, "%.*g", digits, x);
            wrong += detail::rounded_text(x, digits) != text;
        }
        const double read = std::strtod(detail::exact_text(x).c_str(), nullptr);
        wrong +=
            std::isnan(x) ? !std::isnan(read) : std::bit_cast<std::uint64_t>(read) != std::bit_cast<std::uint64_t>(x);
    }
    CHECK(wrong == 0);
    CHECK(detail::exact_text(0.3) == "0.3");
    CHECK(detail::exact_text(0.1 + 0.2) == "0.30000000000000004");
    CHECK(sentence(0.1 + 0.2, ", ", -7, ", ", std::uint64_t(-1)) == "0.3, -7, 18446744073709551615");
}

}  // namespace error_tests
