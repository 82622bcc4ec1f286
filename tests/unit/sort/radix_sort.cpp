/// \file Sorting by keys does what std::stable_sort does, on any number of threads.
#include "support/catch.hpp"
#include <firn/data/random.hpp>
#include <firn/sort/radix_sort.hpp>

#include <limits>

using namespace firn;

TEMPLATE_TEST_CASE("Keys are sorted by all of their bits, and what has the same key stays in its order", "",
                   std::uint32_t, std::uint64_t) {
    using Key = TestType;
    constexpr int digits = std::numeric_limits<Key>::digits;
    RandomSequence random(3);
    RadixSort<Key> sorter;
    for (const std::size_t count : {0, 1, 2, 100, 20000})
        for (const int bits : {0, 3, 21, digits})
            for (const int shift : {0, 5, digits - 8}) {
                std::vector<Keyed<Key>> list(count);
                for (std::size_t i = 0; i < count; ++i) {
                    const Key any = Key(random.bits());
                    list[i] = {Key(~Key(0) - (bits == 0 ? 0 : any >> (digits - bits) << shift)), std::uint32_t(i)};
                }
                std::vector<Keyed<Key>> expected = list;
                std::stable_sort(expected.begin(), expected.end(),
                                 [](const auto& a, const auto& b) { return a.key < b.key; });
                const auto check = [&](auto... how) {
                    sorter.items.assign(list.begin(), list.end());
                    sorter.sort(how...);
                    CHECK(std::equal(
                        sorter.items.begin(), sorter.items.end(), expected.begin(), expected.end(),
                        [](const auto& a, const auto& b) { return a.key == b.key && a.number == b.number; }));
                };
                CAPTURE(count, bits, shift);
                check();
                for (const int threads : {1, 2, 3}) check(std::numeric_limits<Key>::max(), threads);
            }
}
