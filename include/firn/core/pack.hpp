/// \file The class pack, a scalar with SIMD lanes: it holds one number for each of several particles, and arithmetic
/// acts on all lanes at once.
///
/// The class uses the vector extension of g++ and clang, so the same source gives AVX-512, AVX2, SSE2 and NEON code. A
/// loop over floats that the compiler vectorises is as fast as packs, but such a loop cannot skip slow code that only
/// few lanes need. With packs, `if (any(mask))` skips such code.
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/scalar.hpp>
#include <firn/core/x86.hpp>

#include <cstring>
#include <limits>

namespace firn::inline FIRN_BUILD {

namespace detail {
/// Whether any bit of the vector is set. The function combines the two halves of the vector, then the halves of the
/// result, and so on, since g++ 12 compiles a loop over N lanes to N separate extractions.
template <std::size_t Bytes, class V>
FIRN_INLINE bool any_bit(V bits) {
    if constexpr (Bytes == 8) {
        return std::bit_cast<std::int64_t>(bits) != 0;
    } else {
        using half [[gnu::vector_size(Bytes / 2)]] = std::int64_t;
        half low, high;
        std::memcpy(&low, &bits, sizeof low);
        std::memcpy(&high, reinterpret_cast<const char*>(&bits) + sizeof low, sizeof high);
        return any_bit<Bytes / 2>(low | high);
    }
}

/// Returns an integer whose bit i is the sign bit of lane i.
template <class T, int N, class V>
FIRN_INLINE std::uint32_t sign_bits(V bits) {
    using numbers [[gnu::vector_size(sizeof(V))]] = T;
    if constexpr (requires(numbers a) { x86::sign_bits(a); }) {
        return std::uint32_t(x86::sign_bits(numbers(bits)));
    } else {
        std::uint32_t set = 0;
        for (int i = 0; i < N; ++i) set |= std::uint32_t(bits[i] < 0) << i;
        return set;
    }
}

/// Returns √a, lane by lane. If the processor has an instruction for square roots, that instruction is used directly,
/// since g++ 12 does not vectorise a loop over the lanes.
template <class T, class V>
FIRN_INLINE V sqrt_of_lanes(V a) {
    if constexpr (requires { x86::sqrt(a); }) {
        return x86::sqrt(a);
    } else {
        for (int i = 0; i < int(sizeof(V) / sizeof(T)); ++i) a[i] = firn::sqrt(T(a[i]));
        return a;
    }
}

/// Returns the largest whole number ≤ a, lane by lane. A number that is too large to have a fraction is returned
/// unchanged.
template <class P>
FIRN_INLINE P floor_of_lanes(P a) {
    using V = typename P::vector;
    if constexpr (requires { x86::floor(a.lanes); }) {
        return {x86::floor(a.lanes)};
    } else {
        const V whole = __builtin_convertvector(__builtin_convertvector(a.lanes, typename P::mask_vector), V);
        const P down = select(a < P(whole), P(whole) - P(1), P(whole));
        return select(abs(a) < P(sizeof(value_type_t<P>) == 4 ? 0x1p23 : 0x1p52), down, a);
    }
}
}  // namespace detail

/// A SIMD vector of N numbers of type T, one in each lane. N is a power of two.
template <std::floating_point T, int N>
struct pack {
    static_assert(N > 1 && (N & (N - 1)) == 0, "a pack has a power of two of lanes");

    /// The integer type of the same size as T.
    using integer = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
    using vector [[gnu::vector_size(N * sizeof(T))]] = T;             ///< The compiler's vector of N numbers.
    using mask_vector [[gnu::vector_size(N * sizeof(T))]] = integer;  ///< The compiler's vector of N integers.

    /// The result of a comparison. In each lane either all bits are set (the mask is on) or no bit is set (the mask is
    /// off).
    struct mask {
        mask_vector bits;  ///< −1 in lanes that are on, else 0
        /// Logical operators, lane by lane: a and b, a or b, not a.
        /// @{
        FIRN_INLINE friend mask operator&(mask a, mask b) { return {a.bits & b.bits}; }
        FIRN_INLINE friend mask operator|(mask a, mask b) { return {a.bits | b.bits}; }
        FIRN_INLINE friend mask operator!(mask a) { return {~a.bits}; }
        /// @}

        /// Whether the mask is on in a lane.
        FIRN_INLINE bool operator[](int lane) const { return bits[lane] != 0; }
        /// Conversion to bool. It stops the compilation with a message, since a policy cannot branch on a comparison of
        /// scalars.
        template <class M = mask>
        explicit constexpr operator bool() const {
            return detail::refuse_to_branch<M>();
        }
    };

    vector lanes;  ///< the numbers, one in each lane

    pack() = default;  ///< Leaves the lanes uninitialised.
    /// Makes a pack from a vector of the compiler's type.
    FIRN_INLINE pack(vector v) : lanes(v) {}
    /// Makes a pack with the same number in all lanes.
    template <class U>
        requires std::is_arithmetic_v<U>
    FIRN_INLINE pack(U value) : lanes(T(value) - vector{}) {}

    /// Returns the number in a lane, 0 ≤ lane < N.
    FIRN_INLINE T operator[](int lane) const { return lanes[lane]; }
    /// Sets the number in a lane, 0 ≤ lane < N.
    FIRN_INLINE void set(int lane, T value) { lanes[lane] = value; }

    /// Reads N consecutive numbers from memory of any alignment.
    FIRN_INLINE static pack load(const T* from) {
        pack p;
        std::memcpy(&p.lanes, from, sizeof p.lanes);
        return p;
    }
    /// Writes the numbers of lanes 0 to N − 1 one after another to memory of any alignment.
    FIRN_INLINE void store(T* to) const { std::memcpy(to, &lanes, sizeof lanes); }
    /// Converts the numbers to the type `integer` and writes the integers to memory of any alignment. The numbers must
    /// be whole and fit into `integer`.
    FIRN_INLINE void store(integer* to) const {
        const mask_vector whole = __builtin_convertvector(lanes, mask_vector);
        std::memcpy(to, &whole, sizeof whole);
    }

    /// Arithmetic, lane by lane.
    /// @{
    FIRN_INLINE friend pack operator+(pack a, pack b) { return {a.lanes + b.lanes}; }
    FIRN_INLINE friend pack operator-(pack a, pack b) { return {a.lanes - b.lanes}; }
    FIRN_INLINE friend pack operator*(pack a, pack b) { return {a.lanes * b.lanes}; }
    FIRN_INLINE friend pack operator/(pack a, pack b) { return {a.lanes / b.lanes}; }
    FIRN_INLINE friend pack operator-(pack a) { return {-a.lanes}; }
    FIRN_INLINE pack& operator+=(pack b) { return *this = *this + b; }
    FIRN_INLINE pack& operator-=(pack b) { return *this = *this - b; }
    FIRN_INLINE pack& operator*=(pack b) { return *this = *this * b; }
    /// @}

    /// Comparisons, lane by lane.
    /// @{
    FIRN_INLINE friend mask operator<(pack a, pack b) { return {a.lanes < b.lanes}; }
    FIRN_INLINE friend mask operator<=(pack a, pack b) { return {a.lanes <= b.lanes}; }
    FIRN_INLINE friend mask operator>(pack a, pack b) { return {a.lanes > b.lanes}; }
    FIRN_INLINE friend mask operator>=(pack a, pack b) { return {a.lanes >= b.lanes}; }
    FIRN_INLINE friend mask operator==(pack a, pack b) { return {a.lanes == b.lanes}; }
    /// @}

    /// Returns `a` in the lanes where the mask is on, and `b` in the other lanes.
    FIRN_INLINE friend pack select(mask m, pack a, pack b) {
        if constexpr (sizeof(vector) <= register_bytes)
            return {m.bits ? a.lanes : b.lanes};
        else
            return {vector((m.bits & mask_vector(a.lanes)) | (~m.bits & mask_vector(b.lanes)))};  // several registers
    }
    /// Whether the mask is on in any lane.
    FIRN_INLINE friend bool any(mask m) { return detail::any_bit<sizeof(mask_vector)>(m.bits); }
    /// Returns an integer whose bit i is 1 if the mask is on in lane i, for N ≤ 32.
    FIRN_INLINE friend std::uint32_t lane_bits(mask m) { return detail::sign_bits<T, N>(m.bits); }
    /// Functions that every scalar has. They act lane by lane, and are documented in core/scalar.hpp and core/bits.hpp.
    /// @{
    FIRN_INLINE friend pack sqrt(pack a) { return {detail::sqrt_of_lanes<T>(a.lanes)}; }
    FIRN_INLINE friend pack abs(pack a) { return {vector(mask_vector(a.lanes) & std::numeric_limits<integer>::max())}; }
    FIRN_INLINE friend pack power_of_two(pack n) { return {detail::bits::power_of_two<T, mask_vector>(n.lanes)}; }
    FIRN_INLINE friend pack exponent_of(pack a) { return {detail::bits::exponent_of<T, mask_vector>(a.lanes)}; }
    FIRN_INLINE friend pack significand_of(pack a) { return {detail::bits::significand_of<T, mask_vector>(a.lanes)}; }
    FIRN_INLINE friend pack leading_half(pack a) { return {detail::bits::leading_half<T, mask_vector>(a.lanes)}; }
    FIRN_INLINE friend pack floor(pack a) { return detail::floor_of_lanes(a); }
    FIRN_INLINE friend mask same_bits(pack a, pack b) { return {mask_vector(a.lanes) == mask_vector(b.lanes)}; }
    /// @}
};

/// Traits of a pack, which has N lanes with numbers of type T.
template <class T, int N>
struct scalar_traits<pack<T, N>> {
    using value_type = T;                      ///< type of the numbers: float or double
    static constexpr int lanes = N;            ///< number of lanes
    static constexpr bool has_friends = true;  ///< makes `firn::has_friends<S>` true for packs
};

/// The pack that fills one SIMD register of the processor. It has at least four lanes, since firn transposes four lanes
/// at a time.
template <std::floating_point T>
using native_pack = pack<T, (register_bytes / sizeof(T) < 4 ? 4 : int(register_bytes / sizeof(T)))>;

/// Returns the largest of the numbers in the N lanes.
template <class T, int N>
FIRN_INLINE T reduce_max(pack<T, N> a) {
    T r = a.lanes[0];
    for (int i = 1; i < N; ++i) r = r < a.lanes[i] ? a.lanes[i] : r;
    return r;
}

}  // namespace firn::inline FIRN_BUILD
