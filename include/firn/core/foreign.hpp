/// \file Conversions from and to the small vectors and matrices of another library.
///
/// core/eigen.hpp provides them for Eigen. A header for another library specialises `foreign` in the same way. In
/// namespace firn it declares `counterpart_of(const Vec<S, D>&, const void*)`, which returns the library's type for a
/// Vec, and the same for a Mat. Without such a header nothing here is called.
#pragma once

#include <firn/core/config.hpp>

#include <concepts>
#include <type_traits>
#include <utility>

namespace firn {

template <class S, int D>
struct Vec;
template <class S, int D>
struct Mat;

/// How to convert type T of another library, which holds numbers. A specialisation has
///
///     owns                                   whether T owns its numbers: an expression does not
///     holds<Rows, Columns>                   whether a T may have this size, as far as its type says
///     template <class S, int Rows, int Columns> static void read(const T&, S* numbers)    column by column
///
/// and, for types that own a fixed number of numbers,
///
///     own                                    firn's type for it: Vec<S, D> or Mat<S, D>
///     static T made(const S* numbers)        from numbers column by column
template <class T>
struct foreign {};

/// A type of another library that holds numbers.
template <class T>
concept is_foreign = requires { foreign<T>::owns; };

/// A type of another library that may have this size.
template <class T, int Rows, int Columns>
concept holds_numbers = is_foreign<T> && foreign<T>::template holds<Rows, Columns>;

/// A type of another library that firn's type Own converts to.
template <class T, class Own>
concept is_made_from = is_foreign<T> && std::same_as<typename foreign<T>::own, Own>;

namespace detail {

/// Stands for a call of F with arguments A…. Compilers remember the answer of has_counterpart. With this argument an
/// answer from before the library's header was included is not reused for other calls.
template <class F, class... A>
struct call_of;

template <class T, class Call>
concept has_counterpart = requires(const T& x, Call* call) { counterpart_of(x, call); };

/// Returns x in the other library's type if it has one, else x.
template <class Call, class T>
FIRN_INLINE decltype(auto) in_other_terms(const T& x) {
    if constexpr (has_counterpart<T, Call>) {
        decltype(counterpart_of(x, static_cast<Call*>(nullptr))) other = x;
        return other;
    } else {
        return (x);
    }
}

/// Converts the result of a function of the user's to firn's types.
template <class T>
FIRN_INLINE auto in_own_terms(const T& x) {
    if constexpr (is_foreign<T>) {
        static_assert(foreign<T>::owns,
                      "firn: this function returns an expression, which refers to values that are gone when it has "
                      "returned. Give it a return type that holds the numbers: Eigen::Matrix<S, D, D>, not auto.");
        return typename foreign<T>::own(x);
    } else {
        return x;
    }
}

template <class F, class... A>
concept takes_own_terms = requires(const F& f, const A&... a) { f(a...); };

template <class F, class... A>
concept takes_other_terms = (has_counterpart<A, call_of<F, A...>> || ...) &&
                            requires(const F& f, const A&... a) { f(in_other_terms<call_of<F, A...>>(a)...); };

/// A function that takes firn's vectors and matrices, or the other library's.
template <class F, class... A>
concept takes = takes_own_terms<F, A...> || takes_other_terms<F, A...>;

/// A function whose result is not an expression of another library, which would refer to destroyed values.
template <class F, class... A>
concept returns_numbers = !requires(const F& f, const A&... a) {
    requires is_foreign<std::remove_cvref_t<decltype(f(a...))>>;
    requires !foreign<std::remove_cvref_t<decltype(f(a...))>>::owns;
};

/// The type that call() returns. It is found without instantiating call().
template <class F, class... A>
struct call_result {};
template <class F, class... A>
    requires takes_own_terms<F, A...>
struct call_result<F, A...> {
    using type = decltype(in_own_terms(std::declval<const F&>()(std::declval<const A&>()...)));
};
template <class F, class... A>
    requires(!takes_own_terms<F, A...> && takes_other_terms<F, A...>)
struct call_result<F, A...> {
    using type =
        decltype(in_own_terms(std::declval<const F&>()(in_other_terms<call_of<F, A...>>(std::declval<const A&>())...)));
};

/// Returns f(a…), for an f that takes firn's types or the other library's. Only a template that deduces the other
/// library's sizes (`Eigen::Matrix<S, D, D>`) needs arguments of these types; other functions convert by themselves.
template <class... A, takes<A...> F>
FIRN_INLINE constexpr typename call_result<F, A...>::type call(const F& f, const A&... a) {
    if constexpr (takes_own_terms<F, A...>)
        return in_own_terms(f(a...));
    else
        return in_own_terms(f(in_other_terms<call_of<F, A...>>(a)...));
}

}  // namespace detail

}  // namespace firn
