/// \file Random numbers that depend only on a seed and a counter: they have the same bits with every compiler and
/// library.
///
/// The distributions of `<random>` are not used, because they may differ between standard libraries.
#pragma once

#include <firn/core/requirements.hpp>

#include <cstdint>

namespace firn::inline FIRN_BUILD {

/// Returns x with its bits mixed: a bijection of 64-bit integers in which a change of one input bit changes about half
/// of the output bits. It is the finaliser of splitmix64 (Steele, Lea & Flood 2014, "Fast splittable pseudorandom
/// number generators", OOPSLA; constants of D. Stafford's variant 13).
constexpr std::uint64_t mix_bits(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/// Returns the random number with index `counter` in the sequence of a seed (splitmix64 with a start value computed
/// from the seed). The numbers of a sequence may be asked for in any order.
constexpr std::uint64_t random_bits(std::uint64_t seed, std::uint64_t counter) {
    // The seed is mixed first. Otherwise, if two seeds differ by the constant below, one of their sequences would be a
    // shifted copy of the other.
    return mix_bits(mix_bits(seed) + (counter + 1) * 0x9e3779b97f4a7c15u);
}

/// Returns a number in [0, 1) made of the upper 53 bits of `bits`, without rounding.
constexpr double unit_interval(std::uint64_t bits) { return double(bits >> 11) * 0x1p-53; }

/// The sequence of random numbers that belongs to one seed.
class RandomSequence {
public:
    /// Makes the sequence of a seed. The first call of bits() or below() uses the first number of the sequence.
    explicit constexpr RandomSequence(std::uint64_t seed) : seed_(seed) {}
    /// Returns the next 64 random bits of the sequence.
    constexpr std::uint64_t bits() { return random_bits(seed_, counter_++); }
    /// Returns a random integer in [0, count), for 0 < count ≤ 2³²: the upper half of a 64-bit product. The
    /// probabilities of the integers differ by less than count / 2³², relative to their mean.
    constexpr std::uint64_t below(std::uint64_t count) { return ((bits() >> 32) * count) >> 32; }

private:
    std::uint64_t seed_;
    std::uint64_t counter_ = 0;
};

}  // namespace firn::inline FIRN_BUILD
