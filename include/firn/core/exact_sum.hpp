/// \file Sums of doubles without rounding errors, so that the order in which numbers are added makes no difference.
#pragma once

#include <firn/core/pack.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace firn::inline FIRN_BUILD {

/// An exact sum of doubles, which is rounded once, when it is read. It has the same bits for any order of the numbers,
/// and for any way to cut them into parts that are summed on their own.
///
/// The sum is an integer number of the smallest subnormal double, and wide enough for all doubles (Kulisch and Miranker
/// 1986). It consists of digits of 32 bits, each in an integer of 64 bits, so that carries can wait (Neal 2015).
/// Carries are done in time: no number of additions is too large.
class alignas(64) ExactSum {
public:
    /// Number of integers in digits().
    static constexpr std::size_t size = 72;

    /// Adds a number. Also ±∞ and NaN may be added.
    void add(double x) {
        using L = binary_layout<double>;
        const auto bits = std::bit_cast<std::uint64_t>(x);
        const std::uint64_t exponent = bits >> L::fraction_bits & largest_exponent;
        if (exponent == largest_exponent) [[unlikely]] {
            ++digits_[(bits & L::fraction_mask) != 0 ? not_numbers : x > 0 ? infinities : minus_infinities];
            return;
        }
        const std::uint64_t normal = exponent != 0;
        const std::uint64_t significand = (bits & L::fraction_mask) | normal << L::fraction_bits;
        const std::uint64_t place = exponent - normal, shift = place % digit_bits, low = significand << shift;
        const std::int64_t sign = -std::int64_t(bits >> 63);  // 0 or −1; (a ^ sign) − sign is a or −a
        std::int64_t* const digits = digits_.data() + place / digit_bits;
        digits[0] += (std::int64_t(low & digit_mask) ^ sign) - sign;
        digits[1] += (std::int64_t(low >> digit_bits) ^ sign) - sign;
        digits[2] += (std::int64_t(significand >> 1 >> (63 - shift)) ^ sign) - sign;
        if (++digits_[additions] == most_additions) normalise();
    }

    /// Adds many numbers. This is faster than one call for each number.
    void add(std::span<const double> numbers) {
        for (; numbers.size() > at_once; numbers = numbers.subspan(at_once)) add_some(numbers.first(at_once));
        add_some(numbers);
    }

    /// Adds all numbers that were added to `other`.
    ExactSum& operator+=(const ExactSum& other) {
        if (digits_[additions] + other.digits_[additions] >= most_additions) {
            normalise();
            ExactSum more = other;
            more.normalise();
            return add_digits(more);
        }
        return add_digits(other);
    }

    /// Returns the sum, rounded to the nearest double; if two are equally near, the one with an even last digit. A sum
    /// that rounds to more than the largest double is ±∞. The sum of no numbers, and every other zero, is +0. If a NaN
    /// was added, or ∞ and −∞ were, the sum is the NaN of std::numeric_limits::quiet_NaN(); else, if ±∞ was added, it
    /// is ±∞.
    double value() const {
        ExactSum sum = *this;
        sum.normalise();
        const bool is_infinite = sum.digits_[infinities] > 0, is_minus_infinite = sum.digits_[minus_infinities] > 0;
        if (sum.digits_[not_numbers] > 0 || (is_infinite && is_minus_infinite))
            return std::numeric_limits<double>::quiet_NaN();
        if (is_infinite || is_minus_infinite) return (is_infinite ? 1 : -1) * std::numeric_limits<double>::infinity();

        const bool is_negative = sum.digits_[digit_count - 1] < 0;
        if (is_negative) {
            for (int k = 0; k < digit_count; ++k) sum.digits_[std::size_t(k)] *= -1;
            sum.normalise();
        }
        const auto digit = [&](int k) { return k < 0 ? std::uint64_t(0) : std::uint64_t(sum.digits_[std::size_t(k)]); };
        int top = digit_count - 1;
        while (top >= 0 && digit(top) == 0) --top;
        if (top < 0) return 0;
        // The leading 64 bits; those below them matter only if they decide a tie.
        const int width = int(std::bit_width(digit(top)));
        const std::uint64_t leading =
            (digit(top) << digit_bits | digit(top - 1)) << (digit_bits - width) | digit(top - 2) >> width;
        bool has_more = (digit(top - 2) & ((std::uint64_t(1) << width) - 1)) != 0;
        for (int k = top - 3; k >= 0 && !has_more; --k) has_more = digit(k) != 0;
        constexpr int dropped = 64 - std::numeric_limits<double>::digits;
        constexpr std::uint64_t half = std::uint64_t(1) << (dropped - 1);
        const std::uint64_t kept = leading >> dropped, rest = leading & (2 * half - 1);
        const bool is_up = rest > half || (rest == half && (has_more || kept % 2 == 1));
        constexpr int smallest = std::numeric_limits<double>::min_exponent - std::numeric_limits<double>::digits;
        const double magnitude =
            std::ldexp(double(kept + is_up), digit_bits * top + width - std::numeric_limits<double>::digits + smallest);
        return is_negative ? -magnitude : magnitude;
    }

    /// Carries, so that every digit but the highest is from 0 to 2³² − 1. The sum remains the same.
    void normalise() {
        for (std::size_t k = 0; k + 1 < std::size_t(digit_count); ++k) {
            digits_[k + 1] += digits_[k] >> digit_bits;
            digits_[k] &= std::int64_t(digit_mask);
        }
        digits_[additions] = 1;
        for (const std::size_t k : {not_numbers, infinities, minus_infinities})
            digits_[k] = std::min<std::int64_t>(digits_[k], 1);
    }

    /// Returns all that the sum consists of. If up to 2³¹ − 2 sums are normalised and then added integer by integer,
    /// the result is the sum of all their numbers. Call normalise() after that, before anything else is added.
    std::span<std::int64_t, size> digits() { return digits_; }

private:
    static constexpr int digit_bits = 32, digit_count = 68;  // 2098 bits for all doubles, 78 for how many they are
    static constexpr std::uint64_t digit_mask = 0xffffffff, largest_exponent = 0x7ff;
    // Where the other integers lie: how often something was added since the last carry, and how many of the numbers
    // were NaN, ∞ and −∞. An addition changes a digit by less than 2³².
    static constexpr std::size_t additions = digit_count, not_numbers = additions + 1, infinities = additions + 2,
                                 minus_infinities = additions + 3;
    static constexpr std::int64_t most_additions = (std::int64_t(1) << 31) - 1;
    static constexpr int log_at_once = 8;
    static constexpr std::size_t at_once = std::size_t(1) << log_at_once;

    ExactSum& add_digits(const ExactSum& other) {
        for (std::size_t k = 0; k < size; ++k) digits_[k] += other.digits_[k];
        return *this;
    }

    /// Adds at most `at_once` numbers. Their leading bits are split off by adding and subtracting a large number, such
    /// that the sum of the leading bits is exact in double, in any order (Rump, Ogita and Oishi 2008, ExtractVector).
    /// The rests, which are exact as well, are treated in the same way until nothing is left.
    void add_some(std::span<const double> numbers) {
        if constexpr (!keeps_order) {
            for (const double x : numbers) add(x);
            return;
        }
        using P = pack<double, int(register_bytes / sizeof(double))>;
        constexpr std::size_t lanes = register_bytes / sizeof(double);
        constexpr int ways = 4;  // independent sums, so that an addition need not wait for the one before it
        constexpr std::size_t stride = ways * lanes;
        alignas(64) double rests[at_once];
        const std::size_t end = (numbers.size() + stride - 1) / stride * stride;
        std::fill(std::copy(numbers.begin(), numbers.end(), rests), rests + end, 0.0);

        P most[ways], sum[ways];
        const auto larger = [](P a, P b) FIRN_LAMBDA { return select(a < b, b, a); };
        const auto clear = [&] { unroll<ways>([&](auto w) { most[w] = sum[w] = P(0); }); };
        const auto fold = [&] {
            for (int w = 1; w < ways; ++w) {
                most[0] = larger(most[0], most[w]);
                sum[0] += sum[w];
            }
        };
        clear();
        for (std::size_t i = 0; i < end; i += stride)
            unroll<ways>([&](auto w) FIRN_LAMBDA {
                const P x = P::load(rests + i + w * lanes);
                most[w] = larger(most[w], abs(x));
                sum[w] += x - x;  // 0; NaN if x is not finite
            });
        fold();
        const bool is_finite = !any(!(sum[0] == P(0)));
        for (;;) {
            const double largest = reduce_max(most[0]);
            if (is_finite && largest == 0) return;
            if (!is_finite || largest < 0x1p-900 || largest > 0x1p1000) {
                for (std::size_t i = 0; i < end; ++i) add(rests[i]);
                return;
            }
            // If 2^e is the power of two at or below the largest magnitude, this is 1.5 · 2^(e + log_at_once).
            using L = binary_layout<double>;
            const std::int64_t exponent = (std::bit_cast<std::int64_t>(largest) >> L::fraction_bits) + log_at_once;
            const P large =
                std::bit_cast<double>(exponent << L::fraction_bits | std::int64_t(1) << (L::fraction_bits - 1));
            clear();
            for (std::size_t i = 0; i < end; i += stride)
                unroll<ways>([&](auto w) FIRN_LAMBDA {
                    const P x = P::load(rests + i + w * lanes), leading = (x + large) - large, rest = x - leading;
                    rest.store(rests + i + w * lanes);
                    most[w] = larger(most[w], abs(rest));
                    sum[w] += leading;
                });
            fold();
            double total = 0;
            for (int lane = 0; lane < int(lanes); ++lane) total += sum[0][lane];
            add(total);
        }
    }
    /// Whether the compiler keeps the order of additions and subtractions.
    static constexpr bool keeps_order =
#ifdef __FAST_MATH__
        false;
#else
        true;
#endif

    std::array<std::int64_t, size> digits_{};
};

/// Returns the digits of several sums, one after another.
inline std::span<std::int64_t> digits_of(std::span<ExactSum> sums) {
    static_assert(sizeof(ExactSum) == ExactSum::size * sizeof(std::int64_t));
    return {reinterpret_cast<std::int64_t*>(sums.data()), sums.size() * ExactSum::size};
}

}  // namespace firn::inline FIRN_BUILD
