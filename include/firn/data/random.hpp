/// \file Random numbers that depend only on a seed and a counter: the same bits with every compiler and library.
///
/// The distributions of `<random>` may differ between standard libraries, so none is used.
#pragma once

#include <firn/core/requirements.hpp>

#include <cstdint>

namespace firn {

/// The finaliser of splitmix64: a bijection of 64 bits in which every input bit moves about half of the output bits
/// (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators", OOPSLA; constants of D. Stafford's
/// variant 13).
constexpr std::uint64_t mix_bits(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/// The counter-th number of a seed's sequence (splitmix64 with its state set by the seed). Counters may come in
/// any order.
constexpr std::uint64_t random_bits(std::uint64_t seed, std::uint64_t counter) {
    // The seed is mixed first. Otherwise the sequences of seeds one increment apart would be shifts of each other.
    return mix_bits(mix_bits(seed) + (counter + 1) * 0x9e3779b97f4a7c15u);
}

/// The upper 53 bits as a number in [0, 1), without rounding.
constexpr double unit_interval(std::uint64_t bits) { return double(bits >> 11) * 0x1p-53; }

/// The random numbers of a seed, one after the other.
class RandomSequence {
public:
    /// Begins the sequence of a seed.
    explicit constexpr RandomSequence(std::uint64_t seed) : seed_(seed) {}
    /// The next 64 random bits.
    constexpr std::uint64_t bits() { return random_bits(seed_, counter_++); }
    /// A random integer in [0, count), 0 < count ≤ 2³²: the upper half of a product, with a bias below count / 2³².
    constexpr std::uint64_t below(std::uint64_t count) { return ((bits() >> 32) * count) >> 32; }

private:
    std::uint64_t seed_;
    std::uint64_t counter_ = 0;
};

}  // namespace firn
