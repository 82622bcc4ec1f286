/// \file Deformation gradients in memory: F − I in firn's own particles, F or F − I in another program's arrays.
#include "support/catch.hpp"
#include <firn/data/particles.hpp>
#include <firn/material/fluid.hpp>

#include <bit>
#include <cmath>
#include <random>
#include <vector>

namespace less_one_tests {
namespace {
using namespace firn;

std::vector<float> numbers(int count) {
    std::mt19937 engine(5);
    std::vector<float> all;
    for (int i = 0; i < count; ++i) {
        const float digits = 1 + float(engine() >> 9) * 0x1p-23F;  // 1 to 2
        all.push_back(std::ldexp(digits, int(engine() % 40) - 38) * (engine() % 2 ? 1 : -1));
    }
    return all;
}
}  // namespace

TEST_CASE("Fields of a state and their remainders give back every bit of F - I and of J - 1") {
    const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, 0.25};
    Particles<float, 3> solid(domain);
    Particles<float, 3, Fluid<float>::state<3>> fluid(domain);
    const std::size_t of_F = solid.table().size() - 1, of_J = fluid.table().size() - 1;
    CHECK(solid.table()[of_F].less_one);
    CHECK(solid.table()[of_F].components_less_one(3) == 3);
    CHECK(fluid.table()[of_J].components_less_one(3) == 1);
    for (const float number : numbers(2000)) {
        const std::size_t slot = solid.push_back({0.5, 0.5, 0.5});
        auto H = Mat<float, 3>::diagonal(number);
        H(0, 1) = number;
        H(2, 2) = -number;
        solid.set_state(slot, {DeformationGradient<float, 3>::from_displacement(H)});
        float F[9], remainder[3];
        solid.get(of_F, slot, F);
        solid.get_remainders(of_F, slot, remainder);
        REQUIRE(F[0] == 1 + number);
        REQUIRE(F[1] == number);
        solid.set_state(slot, {});
        solid.set(of_F, slot, F, remainder);
        REQUIRE(displacement_gradient(solid.state(slot).F).m[0] == number);
        REQUIRE(displacement_gradient(solid.state(slot).F).m[8] == -number);

        const std::size_t drop = fluid.push_back({0.5, 0.5, 0.5});
        fluid.set_state(drop, {VolumeRatio<float>::from_excess(number)});
        float J = 0, lack = 0;
        fluid.get(of_J, drop, &J);
        fluid.get_remainders(of_J, drop, &lack);
        fluid.set(of_J, drop, &J, &lack);
        REQUIRE(fluid.state(drop).J.excess == number);
        fluid.set(of_J, drop, &J);
        REQUIRE(fluid.state(drop).J.excess == (1 + number) - 1);
    }
}

TEST_CASE("New particles and padding are undeformed") {
    Particles<float, 2> particles(Domain<2>{{0, 0}, {1, 1}, 0.25});
    const std::size_t slot = particles.ParticleStore<float, 2>::push_back({0.5, 0.5});
    CHECK(squared_norm(displacement_gradient(particles.state(slot).F)) == 0);
    CHECK(particles.state(slot).F(1, 1) == 1);
}

TEST_CASE("A number of F that the program has set replaces what was stored beside it") {
    Particles<float, 2> particles(Domain<2>{{0, 0}, {1, 1}, 0.25});
    const std::size_t slot = particles.ParticleStore<float, 2>::push_back({0.5, 0.5});
    auto state = particles.state(slot);
    state.F = DeformationGradient<float, 2>::from_displacement(Mat<float, 2>::diagonal(3e-8F));
    state.F(0, 0) = 1.5F;
    particles.set_state(slot, state);
    CHECK(particles.state(slot).F(0, 0) == 1.5F);
    CHECK(displacement_gradient(particles.state(slot).F)(1, 1) == 3e-8F);
}

TEST_CASE("Another program's arrays hold F, or, if it says so, F - I") {
    using P = pack<float, 4>;
    using State = ElasticState<P, 2>;
    std::vector<float> F{1, 0, 0, 1}, H{3e-8F, 0, 0, 0};
    const std::array<std::uint32_t, pack_size> order = [] {
        std::array<std::uint32_t, pack_size> one;
        one.fill(no_particle);
        one[0] = 0;
        return one;
    }();
    const Slots slots{0, order.data()};
    const std::array<StridedSpan<float>, 1> whole{StridedSpan<float>::matrices<2>(F.data(), true)};
    std::array<StridedSpan<float>, 1> less{StridedSpan<float>::matrices<2>(H.data(), true)};
    less[0].less_one = true;
    CHECK(displacement_gradient(load_state<State>(whole, slots).F).m[0][0] == 0);
    State state = load_state<State>(less, slots);
    CHECK(displacement_gradient(state.F)(0, 0)[0] == 3e-8F);
    CHECK(state.F(1, 1)[0] == 1);
    state.F = increased(state.F, Mat<P, 2>::diagonal(1e-8F));
    store_state(less, slots, state);
    store_state(whole, slots, state);
    CHECK(H[0] == 3e-8F + 1e-8F);
    CHECK(H[3] == 1e-8F);
    CHECK(F == std::vector<float>{1, 0, 0, 1});
    state.F(1, 1) = 2;
    store_state(whole, slots, state);
    CHECK(F == std::vector<float>{1, 0, 0, 2});
}

}  // namespace less_one_tests
