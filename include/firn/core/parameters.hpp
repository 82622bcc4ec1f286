/// \file The list of a policy's parameters, with names and units. firn uses the list to convert a policy to another
/// scalar, to write a policy to a file, and to name the policy's uniforms in a GPU program.
///
/// A policy lists its parameters:
///
///     static constexpr auto parameters() {
///         return std::tuple{firn::parameter{"mu", "Pa", &NeoHookean::mu},
///                           firn::parameter{"lambda", "Pa", &NeoHookean::lambda}};
///     }
///
/// A parameter of a policy may itself be a policy. The parameters of this inner policy then belong to the outer policy,
/// too. If the inner policy is the parameter `inner`, the names of its parameters begin with "inner_".
///
/// A policy that has data besides its parameters may have `std::uint64_t digest() const`, so that a restart tells
/// whether these data are the same. \see firn/core/digest.hpp
///
/// A policy P that has members other than its parameters must define `template <class T> P<T> lifted() const`, a
/// function that returns the policy converted to scalar T. A policy whose scalar is not its first template parameter
/// must define `template <class T> using with_scalar = …`, the type of the policy with scalar T.
#pragma once

#include <firn/core/tensor.hpp>

#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// One parameter of a policy.
/// \tparam Owner  the policy
/// \tparam Field  type of the parameter: a scalar, a Vec, or another policy
template <class Owner, class Field>
struct parameter {
    const char* name;       ///< name of the parameter in state files, GPU programs and messages
    const char* unit;       ///< unit of the parameter, e.g. "Pa"
    Field Owner::* member;  ///< the member of the policy that holds the value
    /// Makes a parameter from its name, its unit, and the member of the policy that holds the value.
    constexpr parameter(const char* n, const char* u, Field Owner::* m) : name(n), unit(u), member(m) {}

    /// Returns the value of this parameter in the given policy.
    /// @{
    FIRN_INLINE constexpr Field& of(Owner& owner) const { return owner.*member; }
    FIRN_INLINE constexpr const Field& of(const Owner& owner) const { return owner.*member; }
    /// @}
};

namespace detail {
template <class P, class T>
struct with_scalar {
    using type = P;  // P has no scalar.
};
template <template <class> class P, class S, class T>
struct with_scalar<P<S>, T> {
    using type = P<T>;
};
template <template <class, int> class P, class S, int D, class T>
struct with_scalar<P<S, D>, T> {
    using type = P<T, D>;
};
template <class P, class T>
struct with_scalar_of : with_scalar<P, T> {};
template <class P, class T>
    requires requires { typename P::template with_scalar<T>; }
struct with_scalar_of<P, T> {
    using type = typename P::template with_scalar<T>;
};
}  // namespace detail

/// The type of policy P with scalar T in place of its scalar S: `P<T>` for `P<S>`, `P<T, D>` for `P<S, D>`.
template <class P, class T>
using with_scalar_t = typename detail::with_scalar_of<P, T>::type;

/// A policy that lists its parameters.
template <class P>
concept has_parameters = requires { P::parameters(); };

/// A policy that lift() can convert to another scalar: a policy without a scalar, one that lists its parameters, or one
/// with a function lifted().
template <class P>
concept can_be_lifted = std::same_as<with_scalar_t<P, float>, with_scalar_t<P, double>> || has_parameters<P> ||
                        requires(const P policy) { policy.template lifted<double>(); };

/// A policy whose member `all` is a list of other policies. The length of this list is known only at run time.
template <class P>
concept is_list = requires(P policy) { policy.all.size(); };

namespace detail {
template <class T>
inline constexpr bool is_vector = false;
template <class S, int D>
inline constexpr bool is_vector<Vec<S, D>> = true;
/// Whether a parameter of type T is an inner policy, not a number or a vector.
template <class T>
concept is_policy = std::is_class_v<T> && !scalar<T> && !is_vector<T>;
}  // namespace detail

// lift() is declared here because lift_value() calls lift() for policies that are parameters of other policies.
template <class T, class P>
FIRN_INLINE auto lift(const P& policy);

namespace detail {
template <class T, class S>
FIRN_INLINE auto lift_value(const S& value) {
    if constexpr (has_parameters<S>)
        return lift<T>(value);
    else
        return T(value);
}
template <class T, class S, int D>
FIRN_INLINE Vec<T, D> lift_value(const Vec<S, D>& value) {
    return cast<T>(value);
}

/// Returns the components of a parameter: one number, or those of a vector.
/// @{
template <class S>
    requires std::is_arithmetic_v<S>
std::vector<double> as_doubles(S value) {
    return {double(value)};
}
template <class S, int D>
[[gnu::cold]] std::vector<double> as_doubles(const Vec<S, D>& value) {
    return {value.v, value.v + D};
}
/// @}
}  // namespace detail

/// Calls f(name, unit, value) for every scalar and every vector among the parameters of a policy. The parameters of its
/// inner policies are included; an inner policy without a list of parameters has none. For a list of policies, each
/// name begins with the index of the policy in the list: "0_", "1_", … For a type without parameters, f is not called.
/// \param before  text that is put in front of all names
template <class P, class F>
void for_parameters(P& policy, const F& f, const std::string& before = "") {
    if constexpr (has_parameters<std::remove_const_t<P>>)
        std::apply(
            [&](const auto&... p) {
                [[maybe_unused]] const auto visit = [&](const auto& one) {
                    auto& value = one.of(policy);
                    using Value = std::remove_cvref_t<decltype(value)>;
                    if constexpr (detail::is_policy<Value>)
                        for_parameters(value, f, before + one.name + "_");
                    else
                        f(before + one.name, one.unit, value);
                };
                (visit(p), ...);
            },
            std::remove_const_t<P>::parameters());
    else if constexpr (is_list<std::remove_const_t<P>>)
        for (std::size_t k = 0; k < policy.all.size(); ++k)
            for_parameters(policy.all[k], f, before + std::to_string(k) + "_");
}

/// Returns the policy converted to scalar T: every parameter that the policy lists in parameters() is converted, e.g.
/// from a float to a pack of sixteen equal numbers.
template <class T, class P>
FIRN_INLINE auto lift(const P& policy) {
    using Lifted = with_scalar_t<P, T>;
    if constexpr (std::same_as<Lifted, P>) {
        return policy;
    } else if constexpr (requires { policy.template lifted<T>(); }) {
        return policy.template lifted<T>();
    } else if constexpr (!has_parameters<P>) {
        static_assert(can_be_lifted<P>,
                      "firn: a policy with a scalar parameter type must list its fields in a static "
                      "function parameters(); see firn/core/parameters.hpp.");
        return Lifted{};
    } else {
        Lifted lifted{};
        constexpr auto from = P::parameters();
        constexpr auto to = Lifted::parameters();
        constexpr int count = int(std::tuple_size_v<decltype(from)>);
        unroll<count>([&](auto i) FIRN_LAMBDA {
            std::get<i>(to).of(lifted) = detail::lift_value<T>(std::get<i>(from).of(policy));
        });
        return lifted;
    }
}

}  // namespace firn::inline FIRN_BUILD
