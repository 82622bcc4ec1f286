/// \file Quads of particles to registers and back: consecutive ones, and ones from anywhere in an array.
#include "support/catch.hpp"
#include <firn/simd/transpose.hpp>

#include <vector>

using namespace firn;

TEMPLATE_TEST_CASE("quads from anywhere go to the lanes that ask for them, and back to where they belong", "[simd]",
                   (pack<float, 4>), (pack<float, 8>), (pack<float, 16>), (pack<double, 4>), (pack<double, 8>)) {
    using S = value_type_t<TestType>;
    constexpr int lanes = scalar_traits<TestType>::lanes;
    std::vector<S> quads(4 * 64);
    for (std::size_t i = 0; i < quads.size(); ++i) quads[i] = S(i);
    const auto of_lane = [](int l) { return std::uint32_t((l * 11 + 5) % 64); };  // all different
    TestType r[4];
    load_quads_of(quads.data(), of_lane, r);
    for (int k = 0; k < 4; ++k)
        for (int l = 0; l < lanes; ++l) REQUIRE(r[k][l] == S(4 * of_lane(l) + std::uint32_t(k)));
    for (int k = 0; k < 4; ++k) r[k] = r[k] * TestType(S(-1)) - TestType(S(1000));
    auto expected = quads;
    for (int l = 0; l < lanes; ++l)
        for (std::size_t k = 0; k < 4; ++k) {
            S& number = expected[4 * of_lane(l) + k];
            number = -number - 1000;
        }
    store_quads_of(r, quads.data(), of_lane);
    CHECK(quads == expected);
}

TEMPLATE_TEST_CASE("quads that are stored in a row are read back, each for the lane that says quad_of_lane()", "[simd]",
                   (pack<float, 4>), (pack<float, 8>), (pack<float, 16>), (pack<double, 4>), (pack<double, 8>)) {
    using S = value_type_t<TestType>;
    constexpr int lanes = scalar_traits<TestType>::lanes;
    TestType r[4], again[4];
    for (int k = 0; k < 4; ++k)
        for (int l = 0; l < lanes; ++l) r[k].set(l, S(10 * l + k));
    S quads[4 * lanes];
    store_quads(r, quads);
    for (int l = 0; l < lanes; ++l)
        for (int k = 0; k < 4; ++k) REQUIRE(quads[4 * quad_of_lane<TestType>(l) + k] == S(10 * l + k));
    load_quads(quads, again);
    for (int l = 0; l < lanes; ++l)
        for (int k = 0; k < 4; ++k) CHECK(again[k][l] == S(10 * l + k));
}
