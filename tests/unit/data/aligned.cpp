/// \file Where memory begins.
#include "support/catch.hpp"
#include <firn/data/aligned.hpp>

#include <cstdint>

using namespace firn;

TEST_CASE("memory begins on a cache line; much memory on a large page", "[data][aligned]") {
    const auto place = [](const auto& numbers) { return reinterpret_cast<std::uintptr_t>(numbers.data()); };
    for (const std::size_t bytes : {std::size_t(1), std::size_t(100), (std::size_t(4) << 20) - 1}) {
        const aligned_vector<char> a(bytes), b(bytes);
        CHECK(place(a) % 64 == 0);
        CHECK(place(b) % 64 == 0);
    }
    aligned_vector<float> large((std::size_t(1) << 20) + 3, 2.0f);  // 4 MiB and a little
    CHECK(place(large) % (std::size_t(2) << 20) == 0);
    large.resize(3 * large.size(), 5.0f);
    CHECK(place(large) % (std::size_t(2) << 20) == 0);
    CHECK(large.front() == 2.0f);
    CHECK(large.back() == 5.0f);
}
