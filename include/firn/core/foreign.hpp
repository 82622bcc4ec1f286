/// \file The door for the small vectors and matrices of another library, so that whoever has those passes them.
///
/// core/eigen.hpp opens it for Eigen. A header for another library specialises `foreign` in the same way, and declares
/// in this namespace counterpart_of(const Vec<S, D>&, const void*), and the same of a Mat, which return its types for
/// them. Where no such header is included nothing here is ever called.
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

/// What firn knows of a type of another library that holds numbers. A specialisation has
///
///     owns                                   whether it keeps its numbers itself: an expression does not
///     holds<Rows, Columns>                   whether it may hold so many, by its type
///     template <class S, int Rows, int Columns> static void read(const T&, S* numbers)    column after column
///
/// and, for types that own a fixed number of them,
///
///     own                                    firn's type for it: Vec<S, D> or Mat<S, D>
///     static T made(const S* numbers)        from numbers column after column
template <class T>
struct foreign {};

template <class T>
concept is_foreign = requires { foreign<T>::owns; };

template <class T, int Rows, int Columns>
concept holds_numbers = is_foreign<T> && foreign<T>::template holds<Rows, Columns>;

/// A type of the other library whose values are made from firn's type Own.
template <class T, class Own>
concept is_made_from = is_foreign<T> && std::same_as<typename foreign<T>::own, Own>;

namespace detail {

/// A call of F with these arguments. What is asked for one, before a header that opens the door was included, is no
/// answer for another.
template <class F, class... A>
struct call_of;

template <class T, class Call>
concept has_counterpart = requires(const T& x, Call* call) { counterpart_of(x, call); };

/// x in the other library's type, where that is a vector or matrix.
template <class Call, class T>
FIRN_INLINE decltype(auto) in_other_terms(const T& x) {
    if constexpr (has_counterpart<T, Call>) {
        decltype(counterpart_of(x, static_cast<Call*>(nullptr))) other = x;
        return other;
    } else {
        return (x);
    }
}

/// What a function of the user's has returned, in firn's types.
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

/// A function that is called with firn's vectors and matrices, or with the other library's.
template <class F, class... A>
concept takes = takes_own_terms<F, A...> || takes_other_terms<F, A...>;

/// A function whose result holds its numbers, or is none of another library's.
template <class F, class... A>
concept returns_numbers = !requires(const F& f, const A&... a) {
    requires is_foreign<std::remove_cvref_t<decltype(f(a...))>>;
    requires !foreign<std::remove_cvref_t<decltype(f(a...))>>::owns;
};

/// What call() returns, found without a look into the function.
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

/// f(a…), whichever library's vectors and matrices it is written for. A template that deduces the sizes of the other's
/// (Eigen::Matrix<S, D, D>) is called with those; what takes types without deducing converts by itself.
template <class... A, takes<A...> F>
FIRN_INLINE constexpr typename call_result<F, A...>::type call(const F& f, const A&... a) {
    if constexpr (takes_own_terms<F, A...>)
        return in_own_terms(f(a...));
    else
        return in_own_terms(f(in_other_terms<call_of<F, A...>>(a)...));
}

}  // namespace detail

}  // namespace firn
