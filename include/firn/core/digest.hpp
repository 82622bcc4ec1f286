/// \file A digest of numbers: 64 bits by which a restart tells whether a policy has the same data.
///
/// A policy may have data that are no parameters, such as the distances of a DistanceGrid or a table of heights. If it
/// has a function digest(), restore() with Restart::same_bits compares its result with that in the state:
///
///     std::uint64_t digest() const { return firn::Digest().add(heights).value(); }
#pragma once

#include <firn/core/tensor.hpp>

#include <bit>
#include <concepts>
#include <cstdint>
#include <iterator>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

/// Computes a digest of numbers, which are added one after the other. It depends on every bit of the numbers, on their
/// order and on how many there are, and is the same on all machines. Different data have the same digest with a
/// probability of about 2⁻⁶⁴, unless someone has made them for it.
class Digest {
public:
    /// Adds a number, or a value of an enumeration.
    template <class T>
        requires(std::is_arithmetic_v<T> || std::is_enum_v<T>)
    Digest& add(const T& number) {
        if constexpr (std::same_as<T, float>)
            mix(std::bit_cast<std::uint32_t>(number));
        else if constexpr (std::floating_point<T>)
            mix(std::bit_cast<std::uint64_t>(double(number)));
        else
            mix(std::uint64_t(number));
        return *this;
    }
    /// Adds the components of a vector.
    template <class S, int D>
    Digest& add(const Vec<S, D>& vector) {
        for (const S& component : vector.v) add(component);
        return *this;
    }
    /// Adds the elements of a matrix.
    template <class S, int D>
    Digest& add(const Mat<S, D>& matrix) {
        for (const S& element : matrix.m) add(element);
        return *this;
    }
    /// Adds the number of elements of a list, and the elements: numbers, vectors or lists. A text is a list of
    /// characters.
    template <class List>
        requires requires(const List& list) { std::size(list), std::begin(list); }
    Digest& add(const List& list) {
        add(std::uint64_t(std::size(list)));
        for (const auto& element : list) add(element);
        return *this;
    }
    /// Returns the digest of all that was added.
    std::uint64_t value() const {
        // The finishing steps of MurmurHash3 (Appleby, public domain).
        std::uint64_t value = (value_ ^ value_ >> 33) * 0xff51afd7ed558ccdu;
        value = (value ^ value >> 33) * 0xc4ceb9fe1a85ec53u;
        return value ^ value >> 33;
    }

private:
    // One to one for given bits, and for a given value, so that data that differ in one number never meet.
    void mix(std::uint64_t bits) {
        value_ = (value_ ^ bits) * 0x9e3779b97f4a7c15u;
        value_ ^= value_ >> 32;
    }
    std::uint64_t value_ = 0x243f6a8885a308d3u;
};

}  // namespace firn::inline FIRN_BUILD
