#include "support/catch.hpp"
#include <firn/io/hash_stream.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace xxh3_tests {

std::vector<std::byte> random_bytes(std::size_t count) {
    std::vector<std::byte> bytes(count);
    std::uint64_t x = 88172645463325252;
    for (std::byte& byte : bytes) {
        x ^= x << 13, x ^= x >> 7, x ^= x << 17;
        byte = std::byte(x >> 24);
    }
    return bytes;
}

TEST_CASE("The hash of any number of bytes is that of xxHash", "[io]") {
    const auto bytes = random_bytes(6100);
    std::uint64_t all = 0;
    for (std::size_t n = 0; n < 6000; ++n)
        all = all * 0x9e3779b97f4a7c15u + firn::detail::hash_bytes(std::span(bytes).subspan(n % 13, n));
    CHECK(all == 0x2c08896622727ea8);  // made with XXH3_64bits() of xxHash 0.8.2
}

TEST_CASE("The hash of pieces is that of the whole", "[io]") {
    const auto bytes = random_bytes(6000);
    for (const std::size_t piece : {1, 63, 64, 239, 240, 241, 1023, 1024, 1025, 4000})
        for (std::size_t n = 0; n < bytes.size(); n += piece < 100 ? 397 : 11) {
            const auto all = std::span(bytes).first(n);
            firn::detail::HashStream stream;
            for (std::size_t at = 0; at < n; at += piece) {
                stream.add(all.subspan(at, std::min(piece, n - at)), 1);
                if (at == piece) {  // another process goes on
                    firn::detail::HashStream next;
                    next.go_on_from(stream.bytes());
                    stream = next;
                }
            }
            REQUIRE(stream.hash() == firn::detail::hash_bytes(all));
        }
}

}  // namespace xxh3_tests
