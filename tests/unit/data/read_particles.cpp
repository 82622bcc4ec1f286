/// \file Copies of many particles' fields, against what the store tells of each.
#include "support/catch.hpp"
#include <firn/data/particles.hpp>
#include <firn/data/read_particles.hpp>
#include <firn/material/fluid.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <random>
#include <vector>

namespace read_particles_tests {
namespace {
using namespace firn;

template <class Store>
void fill(Store& store, bool grouped) {
    constexpr int D = int(std::tuple_size_v<decltype(store.domain().periodic)>);
    std::mt19937 engine(11);
    const auto random = [&](double lower, double upper) {
        return std::uniform_real_distribution<double>(lower, upper)(engine);
    };
    for (int i = 0; i < 500; ++i) {
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a) x[a] = random(-0.1, 2.1);  // a little outside, where periodic axes wrap
        const std::size_t slot = store.push_back(x);
        for (std::size_t f = 0; f < store.table().size(); ++f) {
            if (f == Store::place_field) continue;
            double numbers[9];
            for (double& number : numbers) number = random(-2, 2);
            numbers[1] = -0.0;
            store.set(f, slot, numbers);
        }
        if (grouped && i % 3 == 0) store.set_contact_group(slot, 1 + i % 2);
    }
}

/// Whether two numbers have the same bits.
template <class T>
bool same(T a, T b) {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

template <class T, class S, int D, class State>
void check_copies(const Domain<D>& domain, bool grouped) {
    Particles<S, D, State> store(domain);
    fill(store, grouped);
    std::vector<std::uint32_t> slots = slots_by_id(store, 1);
    std::shuffle(slots.begin(), slots.end(), std::mt19937(3));
    std::vector<T> numbers(slots.size() * 9);
    read_positions(store, std::span<const std::uint32_t>(slots), numbers.data());
    for (std::size_t i = 0; i < slots.size(); ++i)
        for (int a = 0; a < D; ++a)
            REQUIRE(same(numbers[i * D + std::size_t(a)], T(store.exact_position(slots[i])[a])));
    for (std::size_t f = 0; f < store.table().size(); ++f) {
        const auto count = std::size_t(store.table()[f].components_in_state(D));
        read_field(store, f, std::span<const std::uint32_t>(slots), numbers.data());
        for (std::size_t i = 0; i < slots.size(); ++i) {
            S one[9];
            store.get(f, slots[i], one);
            for (std::size_t k = 0; k < count; ++k) REQUIRE(same(numbers[i * count + k], T(one[k])));
        }
    }
}
}  // namespace

TEST_CASE("Many particles are read as each of them is") {
    const Domain<3> box{{0, 0, 0}, {2, 2, 2}, 0.125}, ring{{0, 0, 0}, {2, 2, 2}, 0.125, {true, false, true}};
    const Domain<2> flat{{0, 0}, {2, 2}, 0.125, {false, true}};
    check_copies<float, float, 3, ElasticState<float, 3>>(box, false);
    check_copies<double, float, 3, ElasticState<float, 3>>(ring, true);
    check_copies<float, double, 3, Fluid<double>::state<3>>(ring, false);
    check_copies<float, float, 2, ElasticState<float, 2>>(flat, true);
}
}  // namespace read_particles_tests
