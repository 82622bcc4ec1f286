/// \file The same bits: for any number of threads, in every build; and, without FMA and contraction, on every machine.
#include "support/catch.hpp"
#include "support/golden.hpp"

using namespace firn;

namespace {

template <class Run>
void check_threads(const Run& run, [[maybe_unused]] std::uint64_t stored) {
    const std::uint64_t one = run(1);
    for (const int threads : {2, 3, 4, 7}) CHECK(run(threads) == one);
#ifdef FIRN_TEST_PORTABLE
    CHECK(one == stored);
#endif
}

}  // namespace

TEST_CASE("Coloured, 3D, float, APIC, MLS: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads(golden::coloured_3d, golden::of_coloured_3d);
}
TEST_CASE("Coloured, 2D, double, PIC, weight gradients: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads(golden::coloured_2d, golden::of_coloured_2d);
}
TEST_CASE("Fixed point, 3D, float, APIC, MLS: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads(golden::fixed_point_3d, golden::of_fixed_point_3d);
}
TEST_CASE("Fixed point with 64 bits, 3D: the same bits for 1 and 7 threads") {
    const auto one = golden::hash_of_run<3, float, Apic, WeightGradientForce>(FixedPoint<std::int64_t>{1});
    CHECK(golden::hash_of_run<3, float, Apic, WeightGradientForce>(FixedPoint<std::int64_t>{7}) == one);
}
TEST_CASE("Coloured fixed point, 3D: the bits of the atomic one, for 1 and 7 threads") {
    const auto atomic = golden::fixed_point_3d(2);
    using Execution = ColouredFixedPoint<std::int32_t>;
    CHECK(golden::hash_of_run<3, float, Apic, MlsForce>(Execution{1}) == atomic);
    CHECK(golden::hash_of_run<3, float, Apic, MlsForce>(Execution{7}) == atomic);
}
