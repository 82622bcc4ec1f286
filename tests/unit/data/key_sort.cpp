/// \file Sorting by keys does what std::stable_sort does.
#include "support/catch.hpp"
#include <firn/data/key_sort.hpp>
#include <firn/data/random.hpp>

#include <algorithm>

using namespace firn;

TEST_CASE("Keys are sorted by all of their bits, and what has the same key stays in its order") {
    RandomSequence random(3);
    for (const std::size_t count : {0, 1, 2, 100, 3000})
        for (const int bits : {0, 3, 21, 64})
            for (const int shift : {0, 5, 42}) {
                std::vector<Keyed> list(count);
                for (std::size_t i = 0; i < count; ++i) {
                    const std::uint64_t any = random.bits();
                    list[i] = {~std::uint64_t(0) - (bits == 0 ? 0 : any >> (64 - bits) << shift), std::uint32_t(i)};
                }
                std::vector<Keyed> expected = list;
                std::stable_sort(expected.begin(), expected.end(),
                                 [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
                sort_by_key(list);
                CAPTURE(count, bits, shift);
                CHECK(
                    std::equal(list.begin(), list.end(), expected.begin(), expected.end(),
                               [](const Keyed& a, const Keyed& b) { return a.key == b.key && a.number == b.number; }));
            }
}
