/// \file How the programs round, and the WGSL texts of products, quotients and roots that drivers cannot round
/// otherwise than the CPU.
///
/// WGSL allows drivers to compute a b + c with one rounding, to regroup sums, and to round quotients and roots by more
/// than half a unit in the last place. Drivers of hardware do all of this; software drivers do not.
/// benchmarks/README.md tells what was seen.
#pragma once

#include <firn/core/requirements.hpp>

namespace firn::inline FIRN_BUILD::wgsl {

/// How a program writes products, quotients, roots and sums.
enum class Arithmetic {
    plain,  ///< as operators of WGSL; a driver may round them otherwise than the CPU
    /// So that each operation is rounded as IEEE 754 says, on devices that compute fma(a, b, c) with one rounding, and
    /// on those that round all operations of Arithmetic::plain so.
    exact,
};

namespace text {

/// WGSL text of the reciprocal in programs with Arithmetic::plain.
inline constexpr const char* plain_arithmetic = R"(
fn inverse(x: f32) -> f32 { return 1.0f / x; }
)";

/// WGSL text of product(), quotient(), root() and inverse() in programs with Arithmetic::exact.
///
/// A product is an fma() with a zero that the driver does not know. The quotient and the root are one or two steps of
/// Newton's method from what the driver computes, with remainders by fma(): Markstein, Computation of elementary
/// functions on the IBM RISC System/6000 processor, IBM Journal of Research and Development 34 (1990), 111
inline constexpr const char* exact_arithmetic = R"(
fn product(a: f32, b: f32) -> f32 { return fma(a, b, params.negative_zero); }
/// Whether fma() has one rounding: the square of 1 + 2^-12 has 25 binary digits, of which a product loses the last.
fn has_fma() -> bool {
    let x = 1.000244140625f - params.negative_zero;
    return fma(x, x, -1.00048828125f) != 0.0f;
}
/// 2^-e for x = m 2^e with 1 <= |m| < 2; of a zero, an infinity or a NaN what is of no use.
fn normaliser(x: f32) -> f32 { return bitcast<f32>(0x7f000000u - (bitcast<u32>(x) & 0x7f800000u)); }
fn quotient(a: f32, b: f32) -> f32 {
    let at_once = a / b;
    if (!has_fma()) { return at_once; }
    let x = a * normaliser(b);
    let y = b * normaliser(b);
    let near = 1.0f / y;
    let reciprocal = fma(fma(-y, near, 1.0f), near, near);
    let first = product(x, reciprocal);
    let second = fma(fma(-y, first, x), reciprocal, first);
    let third = fma(fma(-y, second, x), reciprocal, second);
    return select(at_once, third, is_finite(third));
}
fn root(x: f32) -> f32 {
    let at_once = sqrt(x);
    if (!has_fma()) { return at_once; }
    let is_small = x < 1e-18f; // then remainders are too small for a float
    let y = select(x, x * 18446744073709551616.0f, is_small);
    let near = inverseSqrt(y);
    let first = product(y, near);
    let second = fma(fma(-first, first, y), 0.5f * near, first);
    return select(at_once, select(second, second * 0.00000000023283064365386963f, is_small), is_finite(second));
}
fn inverse(x: f32) -> f32 { return quotient(1.0f, x); }
)";

}  // namespace text

}  // namespace firn::inline FIRN_BUILD::wgsl
