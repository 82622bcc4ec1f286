/// \file The concept of a contact law: how matter of two contact groups may move relative to each other at a node.
///
/// Matter of one contact group shares one field of velocities: bodies of one group stick together where they touch.
/// Matter of different groups has fields of its own, which meet by a contact law. A law is one file. It must have
///
///     static constexpr bool between_groups = true
///     Vec relative_velocity(a, b, meeting)   the velocity of group a relative to group b after contact [m/s], from
///                                            what the law knows about the meeting; a < b
///
/// and may have
///
///     void check()                           throws parameter_error if a parameter is out of range
///     ContactNormals normals                 how normals are found; regression by default
///     double largest_reach()                 the gap up to which the law acts on groups that do not approach [cells];
///                                            0 by default
///     std::string description()              a text that is written into files
///     std::string description(exactly)       if `exactly` is true, a text with all digits of the numbers, which a
///                                            restart to the same bits compares
#pragma once

#include <firn/core/tensor.hpp>

#include <concepts>

namespace firn::inline FIRN_BUILD {

/// How the normal between two groups at a node is found. The gap is measured along the normal, from the positions of
/// the particles, in either case.
enum class ContactNormals {
    /// By logistic regression: the plane that best separates the particles of both groups around the node. Nairn,
    /// Hammerquist and Smith 2020, "New material point method contact algorithms for improved accuracy,
    /// large-deformation problems, and proper null-space filtering".
    regression,
    /// By the gradients of the groups' volumes at the node. This choice is cheaper, and less accurate at edges and for
    /// curved surfaces. Bardenhagen et al. 2001, "An improved contact algorithm for the material point method and
    /// application to stress propagation in granular material".
    volume_gradient
};

/// What a contact law knows about two groups a and b at a node, before contact.
template <class S, int D>
struct Meeting {
    Vec<S, D> velocity;  ///< velocity of group a relative to group b [m/s]
    Vec<S, D> normal;    ///< unit normal of the surface between them; it points from b into a
    S gap;               ///< distance between their surfaces along the normal [m]; negative if they overlap
    S reduced_mass;      ///< m_a m_b/(m_a + m_b), of the masses at the node [kg]
    S cell_size;         ///< h [m]; a node stands for a part of about h^(D−1) of the surface
    S dt;                ///< time step [s]
};

/// Whether L has a constant `between_groups`. This constant is true if groups of matter meet by the law L.
template <class L>
concept has_between_groups_flag = requires {
    { L::between_groups } -> std::convertible_to<bool>;
};
/// Whether L has a function `relative_velocity(a, b, meeting)`. The function returns the velocity of group a relative
/// to group b after contact [m/s].
template <class L, class S, int D>
concept gives_relative_velocity = requires(const L law, const Meeting<S, D> meeting, int group) {
    { law.relative_velocity(group, group, meeting) } -> std::same_as<Vec<S, D>>;
};

/// Whether L is a contact law: L has a constant `between_groups` and, if this constant is true, a function
/// relative_velocity().
template <class L>
concept contact_law =
    has_between_groups_flag<L> &&
    (!L::between_groups || (gives_relative_velocity<L, double, 2> && gives_relative_velocity<L, double, 3>));

/// Returns how a contact law wants normals to be found.
template <class Law>
ContactNormals normals_of(const Law& law) {
    if constexpr (requires { law.normals; })
        return law.normals;
    else
        return ContactNormals::regression;
}

/// Returns the gap up to which a contact law acts on groups that do not approach each other [cells].
template <class Law>
double reach_of(const Law& law) {
    if constexpr (requires { law.largest_reach(); })
        return law.largest_reach();
    else
        return 0;
}

/// Returns true if L is a contact law. If L is not, the compilation stops with a message.
template <class L>
consteval bool require_contact_law() {
    static_assert(has_between_groups_flag<L>,
                  "firn: a contact law says that groups meet by it: static constexpr bool between_groups = true.");
    static_assert(contact_law<L> || !has_between_groups_flag<L>,
                  "firn: a contact law offers `template <int D> firn::Vec<double, D> relative_velocity(int a, int b, "
                  "const firn::Meeting<double, D>& meeting) const`, for 2D and 3D; see firn/contact/concept.hpp.");
    return contact_law<L>;
}

}  // namespace firn::inline FIRN_BUILD
