#include "support/catch.hpp"
#include <firn/data/curve.hpp>

#include <algorithm>
#include <vector>

using namespace firn;

namespace {

/// Returns the sorted keys of all cubes with coordinates from `first` to `last`.
template <int D>
std::vector<std::uint64_t> keys(int first, int last) {
    const int n = last - first + 1;
    std::vector<std::uint64_t> keys;
    for (int k = 0, all = D == 2 ? n * n : n * n * n; k < all; ++k) {
        BlockCoordinate<D> cube{};
        for (int a = 0, rest = k; a < D; ++a, rest /= n) cube[std::size_t(a)] = first + rest % n;
        keys.push_back(curve_key<D>(cube));
    }
    std::sort(keys.begin(), keys.end());
    return keys;
}

template <int D>
void check_corner() {
    // The cubes in the corner of a domain, with those below its walls, are one piece of the curve.
    for (const int last : {0, 2, 6}) {
        const auto corner = keys<D>(-1, last);
        bool consecutive = true;
        for (std::size_t i = 1; i < corner.size(); ++i) consecutive = consecutive && corner[i] == corner[i - 1] + 1;
        CHECK(consecutive);
    }
    BlockCoordinate<D> highest{}, lowest{};
    highest.fill((1 << 19) - 2);
    lowest.fill(-(1 << 19));
    CHECK(curve_key<D>(highest) == (std::uint64_t(1) << curve_key_bits<D>)-1);
    CHECK(curve_key<D>(lowest) < curve_key<D>(highest));
}

}  // namespace

TEST_CASE("The curve passes through the corner of a domain in one piece", "[curve]") {
    check_corner<2>();
    check_corner<3>();
}
