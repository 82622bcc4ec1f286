/// \file Several particles in one register: a scalar whose arithmetic acts on all lanes at once.
///
/// Built on the vector extension of g++ and clang, so the same source gives AVX-512, AVX2, SSE2 and NEON code and
/// vectorises by its type. (An auto-vectorised loop over plain floats is as fast, but can hold no `any(mask)`: the
/// rare lanes that need a slower path would have to pay for it in every lane.)
#pragma once

#include <firn/core/bits.hpp>
#include <firn/core/scalar.hpp>
#include <firn/core/x86.hpp>

#include <cstring>
#include <limits>

namespace firn {

namespace detail {
/// Whether any bit is set, by OR-ing halves: g++ 12 makes a loop over lanes into N extractions.
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

/// The sign bits of the lanes, lane 0 the lowest.
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

/// Of all lanes, in one instruction where the target has it: g++ 12 takes a loop over lanes apart.
template <class T, class V>
FIRN_INLINE V sqrt_of_lanes(V a) {
    if constexpr (requires { x86::sqrt(a); }) {
        return x86::sqrt(a);
    } else {
        for (int i = 0; i < int(sizeof(V) / sizeof(T)); ++i) a[i] = firn::sqrt(T(a[i]));
        return a;
    }
}

/// Valid for |a| < 2³¹ (float) or 2⁶³ (double); larger numbers have no fraction and are returned as they are.
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

/// N lanes of T in one register; N is a power of two.
template <std::floating_point T, int N>
struct pack {
    static_assert(N > 1 && (N & (N - 1)) == 0, "a pack has a power of two of lanes");

    using integer = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
    using vector [[gnu::vector_size(N * sizeof(T))]] = T;
    using mask_vector [[gnu::vector_size(N * sizeof(T))]] = integer;

    /// The result of a comparison: all bits of a lane set or none.
    struct mask {
        mask_vector bits;
        FIRN_INLINE friend mask operator&(mask a, mask b) { return {a.bits & b.bits}; }
        FIRN_INLINE friend mask operator|(mask a, mask b) { return {a.bits | b.bits}; }
        FIRN_INLINE friend mask operator!(mask a) { return {~a.bits}; }
        FIRN_INLINE bool operator[](int lane) const { return bits[lane] != 0; }
        template <class M = mask>
        explicit constexpr operator bool() const {
            return detail::refuse_to_branch<M>();
        }
    };

    vector lanes;

    pack() = default;
    FIRN_INLINE pack(vector v) : lanes(v) {}
    template <class U>
        requires std::is_arithmetic_v<U>
    FIRN_INLINE pack(U value) : lanes(T(value) - vector{}) {}

    FIRN_INLINE T operator[](int lane) const { return lanes[lane]; }
    FIRN_INLINE void set(int lane, T value) { lanes[lane] = value; }

    /// N consecutive numbers in memory, of any alignment.
    FIRN_INLINE static pack load(const T* from) {
        pack p;
        std::memcpy(&p.lanes, from, sizeof p.lanes);
        return p;
    }
    FIRN_INLINE void store(T* to) const { std::memcpy(to, &lanes, sizeof lanes); }
    /// Numbers without a fraction, that fit.
    FIRN_INLINE void store(integer* to) const {
        const mask_vector whole = __builtin_convertvector(lanes, mask_vector);
        std::memcpy(to, &whole, sizeof whole);
    }

    FIRN_INLINE friend pack operator+(pack a, pack b) { return {a.lanes + b.lanes}; }
    FIRN_INLINE friend pack operator-(pack a, pack b) { return {a.lanes - b.lanes}; }
    FIRN_INLINE friend pack operator*(pack a, pack b) { return {a.lanes * b.lanes}; }
    FIRN_INLINE friend pack operator/(pack a, pack b) { return {a.lanes / b.lanes}; }
    FIRN_INLINE friend pack operator-(pack a) { return {-a.lanes}; }
    FIRN_INLINE pack& operator+=(pack b) { return *this = *this + b; }
    FIRN_INLINE pack& operator-=(pack b) { return *this = *this - b; }
    FIRN_INLINE pack& operator*=(pack b) { return *this = *this * b; }

    FIRN_INLINE friend mask operator<(pack a, pack b) { return {a.lanes < b.lanes}; }
    FIRN_INLINE friend mask operator<=(pack a, pack b) { return {a.lanes <= b.lanes}; }
    FIRN_INLINE friend mask operator>(pack a, pack b) { return {a.lanes > b.lanes}; }
    FIRN_INLINE friend mask operator>=(pack a, pack b) { return {a.lanes >= b.lanes}; }
    FIRN_INLINE friend mask operator==(pack a, pack b) { return {a.lanes == b.lanes}; }

    FIRN_INLINE friend pack select(mask m, pack a, pack b) {
        if constexpr (sizeof(vector) <= register_bytes)
            return {m.bits ? a.lanes : b.lanes};
        else
            return {vector((m.bits & mask_vector(a.lanes)) | (~m.bits & mask_vector(b.lanes)))};  // two registers
    }
    FIRN_INLINE friend bool any(mask m) { return detail::any_bit<sizeof(mask_vector)>(m.bits); }
    /// Bit l: whether lane l is set. Of 32 lanes at most.
    FIRN_INLINE friend std::uint32_t lane_bits(mask m) { return detail::sign_bits<T, N>(m.bits); }
    FIRN_INLINE friend pack sqrt(pack a) { return {detail::sqrt_of_lanes<T>(a.lanes)}; }
    FIRN_INLINE friend pack abs(pack a) { return {vector(mask_vector(a.lanes) & std::numeric_limits<integer>::max())}; }
    // The digits of each lane, see core/bits.hpp.
    FIRN_INLINE friend pack power_of_two(pack n) { return {detail::bits::power_of_two<T, mask_vector>(n.lanes)}; }
    FIRN_INLINE friend pack exponent_of(pack a) { return {detail::bits::exponent_of<T, mask_vector>(a.lanes)}; }
    FIRN_INLINE friend pack significand_of(pack a) { return {detail::bits::significand_of<T, mask_vector>(a.lanes)}; }
    FIRN_INLINE friend pack leading_half(pack a) { return {detail::bits::leading_half<T, mask_vector>(a.lanes)}; }
    FIRN_INLINE friend pack floor(pack a) { return detail::floor_of_lanes(a); }
};

template <class T, int N>
struct scalar_traits<pack<T, N>> {
    using value_type = T;
    static constexpr int lanes = N;
    static constexpr bool has_friends = true;
};

/// The pack that fills one register of the target; at least four lanes, which the transposes work in.
template <std::floating_point T>
using native_pack = pack<T, (register_bytes / sizeof(T) < 4 ? 4 : int(register_bytes / sizeof(T)))>;

template <class T, int N>
FIRN_INLINE T reduce_max(pack<T, N> a) {
    T r = a.lanes[0];
    for (int i = 1; i < N; ++i) r = r < a.lanes[i] ? a.lanes[i] : r;
    return r;
}

}  // namespace firn
