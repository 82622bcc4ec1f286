/// \file Conversions from and to the small vectors and matrices of another library.
///
/// core/eigen.hpp provides these conversions for Eigen. A header for another library must do two things. First, it
/// specialises `foreign` for the types of the library. Second, it declares, in namespace firn,
/// `counterpart_of(const Vec<S, D>&, const void*)` and `counterpart_of(const Mat<S, D>&, const void*)`, whose return
/// types are the library's types for a Vec and a Mat. Without such a header nothing is converted.
#pragma once

#include <firn/core/config.hpp>

#include <concepts>
#include <type_traits>
#include <utility>

namespace firn::inline FIRN_BUILD {

template <class S, int D>
struct Vec;
template <class S, int D>
struct Mat;

/// The conversions of a vector or matrix type T of another library. A specialisation has
///
///     owns                                   true if a T stores its elements, false if T is an expression
///     holds<Rows, Columns>                   whether a T can have Rows × Columns elements, judged by the type alone
///     gives<S>                               whether its elements can become numbers of type S
///     template <class S, int Rows, int Columns> static void read(const T& from, S* numbers);
///                                            writes the elements of `from` to `numbers`, column by column
///
/// and, if a T stores its elements and its size is fixed,
///
///     own                                    firn's type of the same size: Vec<S, D> or Mat<S, D>
///     static T made(const S* numbers)        makes a T from elements that are stored column by column
template <class T>
struct foreign {};

/// A type of another library for which `foreign` is specialised.
template <class T>
concept is_foreign = requires { foreign<T>::owns; };

/// A type of another library whose objects can have Rows × Columns elements.
template <class T, int Rows, int Columns>
concept holds_numbers = is_foreign<T> && foreign<T>::template holds<Rows, Columns>;

/// A type of another library whose objects can have Rows × Columns elements, which can become numbers of type S.
template <class T, class S, int Rows, int Columns>
concept gives_numbers = holds_numbers<T, Rows, Columns> && foreign<T>::template gives<S>;

/// A type of another library into which firn's type Own can be converted.
template <class T, class Own>
concept is_made_from = is_foreign<T> && std::same_as<typename foreign<T>::own, Own>;

namespace detail {

/// A type that identifies one call: the call of a function F with arguments of types A…. The type is a template
/// argument of the concept has_counterpart, so that the compiler checks the concept again for every call. Otherwise the
/// compiler would reuse the result of an earlier check, which may have been made before the other library's header was
/// included.
template <class F, class... A>
struct call_of;

template <class T, class Call>
concept has_counterpart = requires(const T& x, Call* call) { counterpart_of(x, call); };

/// Returns x converted to the other library's type, the return type of counterpart_of(x, …). If no function
/// counterpart_of() accepts x, returns x itself.
template <class Call, class T>
FIRN_INLINE decltype(auto) in_other_terms(const T& x) {
    if constexpr (has_counterpart<T, Call>) {
        decltype(counterpart_of(x, static_cast<Call*>(nullptr))) other = x;
        return other;
    } else {
        return (x);
    }
}

/// Returns x, the result of a user's function. If x has a type of another library, x is converted to firn's type.
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

/// A function F that can be called with arguments of types A…, either with the arguments as they are, or after their
/// conversion to the other library's types.
template <class F, class... A>
concept takes = takes_own_terms<F, A...> || takes_other_terms<F, A...>;

/// A function F that does not return an expression of another library. Such an expression would refer to values that
/// are destroyed when F returns.
template <class F, class... A>
concept returns_numbers = !requires(const F& f, const A&... a) {
    requires is_foreign<std::remove_cvref_t<decltype(f(a...))>>;
    requires !foreign<std::remove_cvref_t<decltype(f(a...))>>::owns;
};

/// The type that call() returns, determined without instantiating call().
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

/// Returns f(a…) in firn's types. If f cannot take the arguments `a` as they are, they are first converted to the other
/// library's types. This conversion is needed only if f is a template that deduces a size from its arguments, e.g. D
/// from `Eigen::Matrix<S, D, D>`. For any other f, the compiler converts the arguments implicitly.
template <class... A, takes<A...> F>
FIRN_INLINE constexpr typename call_result<F, A...>::type call(const F& f, const A&... a) {
    if constexpr (takes_own_terms<F, A...>)
        return in_own_terms(f(a...));
    else
        return in_own_terms(f(in_other_terms<call_of<F, A...>>(a)...));
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
