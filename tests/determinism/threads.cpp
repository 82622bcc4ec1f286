/// \file The same bits: for any number of threads, in every build; and, without FMA and contraction, on every machine.
#include "support/catch.hpp"
#include "support/scenes.hpp"

using namespace firn;

namespace {

template <int D, class S, class Transfer, class Force, class Execution>
std::uint64_t hash_of_run(const Execution& execution) {
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1.0), 1.0 / 32};
    Simulation<D, FixedCorotated<S>, Transfer, Force, QuadraticBSpline, Execution> simulation(
        domain, FixedCorotated<S>::from_young_poisson(1e5, 0.3), execution);
    scenes::add_two_blocks<D>(simulation, D == 2 ? 0.3 : 0.2);
    for (int step = 0; step < 200; ++step) simulation.step();  // automatic time steps: they, too, must agree
    return scenes::hash(simulation);
}

/// Of 200 steps of two colliding blocks, built without contraction and FMA; g++ 12 and clang 19 agree on it.
struct Golden {
    std::uint64_t coloured_3d, coloured_2d, fixed_point_3d;
};
constexpr Golden golden{0xbb68ac153024228b, 0xfdcc5b8efae4337, 0x15adb3a734771a86};

template <int D, class S, class Transfer, class Force, class Execution>
void check_threads([[maybe_unused]] std::uint64_t stored) {
    const std::uint64_t one = hash_of_run<D, S, Transfer, Force>(Execution{1});
    for (const int threads : {2, 3, 4, 7}) CHECK(hash_of_run<D, S, Transfer, Force>(Execution{threads}) == one);
#ifdef FIRN_TEST_PORTABLE
    CHECK(one == stored);
#endif
}

}  // namespace

TEST_CASE("Coloured, 3D, float, APIC, MLS: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<3, float, Apic, MlsForce, Coloured>(golden.coloured_3d);
}
TEST_CASE("Coloured, 2D, double, PIC, weight gradients: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<2, double, Pic, WeightGradientForce, Coloured>(golden.coloured_2d);
}
TEST_CASE("Fixed point, 3D, float, APIC, MLS: the same bits for 1, 2, 3, 4 and 7 threads") {
    check_threads<3, float, Apic, MlsForce, FixedPoint<std::int32_t>>(golden.fixed_point_3d);
}
TEST_CASE("Fixed point with 64 bits, 3D: the same bits for 1, 2, 3, 4 and 7 threads") {
    const auto one = hash_of_run<3, float, Apic, WeightGradientForce>(FixedPoint<std::int64_t>{1});
    CHECK(hash_of_run<3, float, Apic, WeightGradientForce>(FixedPoint<std::int64_t>{7}) == one);
}
TEST_CASE("Coloured fixed point, 3D: the bits of the atomic one, for 1 and 7 threads") {
    const auto atomic = hash_of_run<3, float, Apic, MlsForce>(FixedPoint<std::int32_t>{2});
    CHECK(hash_of_run<3, float, Apic, MlsForce>(ColouredFixedPoint<std::int32_t>{1}) == atomic);
    CHECK(hash_of_run<3, float, Apic, MlsForce>(ColouredFixedPoint<std::int32_t>{7}) == atomic);
}
