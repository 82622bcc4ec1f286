/// \file The policies of a simulation. A program chooses some of them; for the others there are defaults.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/concept.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/contact/one_field.hpp>
#include <firn/force/mls.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/loops/execution.hpp>
#include <firn/simulation/explicit.hpp>
#include <firn/simulation/material_set.hpp>
#include <firn/transfer/apic.hpp>
#include <firn/volumetric/own_volume.hpp>

#include <type_traits>

namespace firn::inline FIRN_BUILD {

template <int D, class Material, class Transfer, class Force, class Kernel, class Execution, class Boundary,
          class Volume, class Law, class Time>
class Simulation;

namespace detail {

// The kind of a policy (transfer, force, …) is recognised by one characteristic member. If a policy has this member but
// lacks another required member, the compiler's message is about the missing one.

template <class P>
struct is_transfer : std::bool_constant<has_affine_flag<P>> {};
template <class P>
struct is_force : std::bool_constant<has_gradient_flag<P>> {};
template <class P>
concept says_support = requires { P::support; };
template <class P>
struct is_kernel : std::bool_constant<says_support<P>> {};
template <class P>
struct is_execution : std::bool_constant<execution_policy<P>> {};
template <class P>
struct is_boundary : std::bool_constant<says_where<P, 2> || says_where<P, 3>> {};
template <class P>
struct is_volumetric : std::bool_constant<has_averages_volume_flag<P>> {};
template <class P>
struct is_contact_law : std::bool_constant<has_between_groups_flag<P>> {};
template <class P>
concept says_explicit = requires { P::is_explicit; };
template <class P>
struct is_time_integration : std::bool_constant<says_explicit<P>> {};

/// Has the member `type`: the first of `Policies` that is a policy of this kind; `Default` if there is none.
template <template <class> class Kind, class Default, class... Policies>
struct first_of_kind : std::type_identity<Default> {};
template <template <class> class Kind, class Default, class First, class... Rest>
struct first_of_kind<Kind, Default, First, Rest...>
    : std::conditional_t<Kind<First>::value, std::type_identity<First>, first_of_kind<Kind, Default, Rest...>> {};

template <template <class> class Kind, class... Policies>
inline constexpr int how_many = (0 + ... + int(Kind<Policies>::value));

/// Returns true. If a type is not a policy, or if two policies are of the same kind, the compiler stops with a message.
template <class... Policies>
consteval bool require_policies() {
    constexpr bool known =
        ((is_transfer<Policies>::value || is_force<Policies>::value || is_kernel<Policies>::value ||
          is_execution<Policies>::value || is_boundary<Policies>::value || is_volumetric<Policies>::value ||
          is_contact_law<Policies>::value || is_time_integration<Policies>::value) &&
         ...);
    static_assert(
        known,
        "firn: what is given to a simulation after its material are policies: a boundary, a transfer, a force form, a "
        "kernel, an execution, a volumetric policy, a contact law or a time integration. One argument is none of "
        "these. (A boundary has "
        "velocity(x, v) and reaches(lower, upper), see firn/boundary/concept.hpp; several materials are given as "
        "firn::Materials{snow, sand}; an acceleration field is given to step() or advance().)");
    constexpr bool once = how_many<is_transfer, Policies...> <= 1 && how_many<is_force, Policies...> <= 1 &&
                          how_many<is_kernel, Policies...> <= 1 && how_many<is_execution, Policies...> <= 1 &&
                          how_many<is_volumetric, Policies...> <= 1 && how_many<is_contact_law, Policies...> <= 1 &&
                          how_many<is_time_integration, Policies...> <= 1;
    static_assert(once,
                  "firn: a simulation has one transfer, force form, kernel, execution, volumetric policy, contact law "
                  "and time integration.");
    constexpr bool one_boundary = how_many<is_boundary, Policies...> <= 1;
    static_assert(one_boundary,
                  "firn: a simulation has one boundary; join several with firn::Together(walls, collider).");
    return known && once && one_boundary;
}

/// Returns true. If a type is not a policy of its kind, the compiler stops with a message.
template <class Kernel, class Transfer, class Force, class Volume, class Law>
consteval bool require_each() {
    return (require_kernel<Kernel>() && require_transfer<Transfer>() && require_force<Force>() &&
            require_volumetric<Volume>() && require_contact_law<Law>()) ||
           true;  // the messages come from these
}

/// The policies of a simulation: the given policies, and, for each kind of policy that is not given, the default of
/// Simulation.
/// \tparam Policies  the given policies, in any order
template <int D, class Material, class... Policies>
struct chosen {
    static_assert(require_policies<Policies...>() || true);  // the messages come from require_policies()
    using transfer = typename first_of_kind<is_transfer, Apic, Policies...>::type;
    using force = typename first_of_kind<is_force, MlsForce, Policies...>::type;
    using kernel = typename first_of_kind<is_kernel, QuadraticBSpline, Policies...>::type;
    using execution = typename first_of_kind<is_execution, Coloured, Policies...>::type;
    using boundary = typename first_of_kind<is_boundary, Walls<precision_of_t<Material>, D>, Policies...>::type;
    using volume = typename first_of_kind<is_volumetric, OwnVolume, Policies...>::type;
    using contact = typename first_of_kind<is_contact_law, OneField, Policies...>::type;
    using time = typename first_of_kind<is_time_integration, Explicit, Policies...>::type;
    using simulation = Simulation<D, Material, transfer, force, kernel, execution, boundary, volume, contact, time>;
};

/// Has the member `are_all<Policies...>`: whether each of the given policies is one of the types `All`.
template <class... All>
struct among {
    template <class One>
    static constexpr bool is_one = (std::same_as<One, All> || ...);
    template <class... Policies>
    static constexpr bool are_all = (is_one<Policies> && ...);
};

/// Returns the argument that has type `Wanted`; the result of otherwise() if no argument has this type.
template <class Wanted, class Otherwise, class... Given>
Wanted one_of(const Otherwise& otherwise, const Given&... given) {
    const Wanted* found = nullptr;
    const auto look = [&](const auto& one) {
        if constexpr (std::same_as<std::remove_cvref_t<decltype(one)>, Wanted>) found = &one;
    };
    (look(given), ...);
    return found ? *found : otherwise();
}

/// Returns the default boundary of a simulation. If `Boundary` is Walls, the result has walls on all faces of the
/// domain except those of periodic axes; matter can separate from these walls. Any other boundary is
/// default-constructed.
/// \throws parameter_error  if the domain is not valid. \see check
template <class Boundary, class S, int D>
Boundary default_boundary(const Domain<D>& domain) {
    check(domain);
    if constexpr (std::same_as<Boundary, Walls<S, D>>) {
        auto walls = Boundary::all(domain.lower, domain.upper, {});
        for (std::size_t a = 0; a < std::size_t(D); ++a)
            if (domain.periodic[a]) walls.at_lower[a].contact = walls.at_upper[a].contact = Contact::none;
        return walls;
    } else if constexpr (acts_by_gap<Boundary>) {
        return {default_boundary<decltype(Boundary::boundary), S>(domain)};
    } else {
        return {};
    }
}

}  // namespace detail

/// The type of a simulation with the given policies, in any order. If a kind of policy is not given, the simulation has
/// the default of Simulation. Examples:
///
///     firn::SimulationWith<3, Snow<float>, Together<Walls<float, 3>, Collider<Sphere<float, 3>>>>
///     firn::SimulationWith<2, Sand<double>, CubicBSpline, WeightGradientForce>
template <int D, class Material, class... Policies>
using SimulationWith = typename detail::chosen<D, Material, Policies...>::simulation;

}  // namespace firn::inline FIRN_BUILD
