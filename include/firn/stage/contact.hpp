/// \file Contact at one node: how the groups of matter that meet there change each other's momenta.
#pragma once

#include <firn/contact/concept.hpp>

#include <cstddef>
#include <span>

namespace firn::inline FIRN_BUILD {

/// A contact group at a node.
template <int D>
struct GroupAtNode {
    int group;                ///< number of the group
    double mass;              ///< its mass at the node [kg]
    Vec<double, D> momentum;  ///< its momentum at the node [kg m/s]
};

/// Two contact groups at a node that may touch.
template <int D>
struct PairAtNode {
    std::size_t first,         ///< index of the one group among the groups at the node
        second;                ///< index of the other group; first < second
    Vec<double, D> normal;     ///< unit normal of the surface between them; it points from `second` into `first`
    double gap;                ///< distance between their surfaces [m]; negative if they overlap
    Vec<double, D> impulse{};  ///< receives the impulse on `first` [N s]; `second` receives the opposite impulse
    Vec<double, D> part{};     ///< the part of the impulse that acts in a sweep [N s]
};

/// Returns the velocity of group a at a node relative to group b [m/s].
template <int D>
Vec<double, D> velocity_between(const GroupAtNode<D>& a, const GroupAtNode<D>& b) {
    return a.momentum * (1 / a.mass) - b.momentum * (1 / b.mass);
}

/// How many times all pairs act on each other at a node at which more than two groups meet.
inline constexpr int contact_sweeps = 16;

/// Lets the groups at a node act on each other by a contact law.
///
/// Each pair receives the impulse that gives it the relative velocity of the law. If more than two groups meet, all
/// pairs act at once, each with a share 1/k of this impulse, and this is repeated contact_sweeps times. k is the number
/// of groups, or one less if that number is even. The n(n−1)/2 pairs of n groups divide into k sets of disjoint pairs,
/// so the sum of the shares is a mean of k impulses, none of which raises the kinetic energy; neither does their mean.
/// The result does not depend on the order of the groups, except for rounding.
/// \param groups  the groups at the node, sorted by number; their momenta change
/// \param pairs   the pairs that may touch; they receive their impulses
/// \param h       cell size [m];  \param dt  time step [s]
template <class Law, int D>
void meet(const Law& law, std::span<GroupAtNode<D>> groups, std::span<PairAtNode<D>> pairs, double h, double dt) {
    const std::size_t n = groups.size();
    const double share = n == 2 ? 1.0 : 1.0 / double(n % 2 == 0 ? n - 1 : n);
    for (int sweep = 0; sweep < (n == 2 ? 1 : contact_sweeps); ++sweep) {
        bool moves = false;
        for (PairAtNode<D>& pair : pairs) {
            const GroupAtNode<D>&a = groups[pair.first], &b = groups[pair.second];
            const double reduced = a.mass * (b.mass / (a.mass + b.mass));
            const Vec<double, D> velocity = velocity_between(a, b);
            const Meeting<double, D> meeting{velocity, pair.normal, pair.gap, reduced, h, dt};
            const Vec<double, D> change = law.relative_velocity(a.group, b.group, meeting) - velocity;
            pair.part = change * (reduced * share);
            moves = moves || dot(change, change) > 0;
        }
        if (!moves) return;
        for (PairAtNode<D>& pair : pairs) {
            groups[pair.first].momentum += pair.part;
            groups[pair.second].momentum -= pair.part;
            pair.impulse += pair.part;
        }
    }
}

}  // namespace firn::inline FIRN_BUILD
