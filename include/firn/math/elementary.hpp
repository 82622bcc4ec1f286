/// \file exp, log, pow, sin and cos for every scalar.
///
/// The functions of the standard library do not run in SIMD lanes, and the last digit of their results depends on the
/// library. firn's functions consist of + − × ÷, comparisons and exact operations on binary digits. They run in all
/// lanes at once, and the bits of their results do not depend on the platform. In your code write `firn::exp(x)`: for a
/// float x, an unqualified exp(x) may call the function of the C library, and std::exp accepts only C++'s own types of
/// numbers.
#pragma once

#include <firn/math/exp_log.hpp>
#include <firn/math/pow.hpp>
#include <firn/math/trigonometric.hpp>

#include <type_traits>

namespace firn::inline FIRN_BUILD {

// Those of traced numbers (firn/math/traced.hpp), so that `firn::exp(x)` in a header that is read before
// firn/adjoint.hpp means them, too.
template <scalar T>
struct traced;
template <scalar T>
traced<T> exp(const traced<T>& x);
template <scalar T>
traced<T> log(const traced<T>& x);
template <scalar T>
traced<T> log(const traced<T>& x, const traced<T>& less_one);
template <scalar T>
traced<T> sin(const traced<T>& x);
template <scalar T>
traced<T> cos(const traced<T>& x);
template <scalar T>
traced<T> pow(const traced<T>& x, const std::type_identity_t<traced<T>>& y);

}  // namespace firn::inline FIRN_BUILD
