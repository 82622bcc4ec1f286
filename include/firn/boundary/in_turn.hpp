/// \file What the surfaces near a node do to its velocity where a rigid body is among them: each in turn.
///
/// at_once.hpp finds the velocity that all surfaces allow, to rounding. But how they share its change may jump as the
/// velocity of one of them changes: a body that slides over matter which a wall holds rubs it along the edge between
/// both, one way or the other. A body whose velocity is sought then finds none that fits what matter does to it.
///
/// Here each surface acts as if alone on the velocity that the others leave, again and again (projected Gauss–Seidel:
/// Jourdan, Alart and Jean 1998, "A Gauss–Seidel like algorithm to solve frictional contact problems"). The number of
/// turns is fixed, so that what each surface does follows all velocities without a jump. Surfaces at right angles need
/// one turn without friction. Of others the one that was added last has its way, and those before it are missed by a
/// little; the gap of the next step makes up for it. More turns make what surfaces do steeper: Newton's method then
/// takes longer, and matter enters bodies hardly less.
#pragma once

#include <firn/boundary/at_once.hpp>

#include <cstddef>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A surface near a node, and the gap between it and matter [m].
template <int D>
struct SurfaceByGap {
    ActingSurface<double, D> is;
    double gap;
    int part;
};

/// The surfaces that act on a node in turn.
template <int D>
class NodeInTurn {
    using V = Vec<double, D>;

public:
    /// \param v      velocity of the node before any surface acts [m/s]
    /// \param reach  gap up to which `slip` and `stick` hold matter [m];  \param dt  [s]
    NodeInTurn(const V& v, double reach, double dt) : before_(v), reach_(reach), dt_(dt) {}

    /// Adds a surface. That which is added last acts last.
    void add(const SurfaceByGap<D>& surface) { surfaces_.push_back(surface), changes_.push_back(V::zero()); }
    std::size_t size() const { return surfaces_.size(); }
    /// Returns what surface k changes the velocity of the node by [m/s]. Call velocity() first.
    const V& change(std::size_t k) const { return changes_[k]; }

    /// Returns the velocity of the node [m/s] after the surfaces have acted.
    V velocity() {
        if (size() > 1) keep_apart();
        V v = before_;
        for (int turn = 0; turn < (size() > 1 ? turns : 1); ++turn)
            for (std::size_t k = 0; k < size(); ++k) {
                v = v - changes_[k];
                const ActingSurface<double, D>& one = surfaces_[k].is;
                const V relative = v - one.velocity;
                changes_[k] = velocity_after_contact(relative, one.normal, one.contact, one.friction, surfaces_[k].gap,
                                                     reach_, dt_) -
                              relative;
                v = v + changes_[k];
            }
        return v;
    }

private:
    static constexpr int turns = 3;

    /// Slows surfaces that close on each other along their normals, as make_room() says.
    void keep_apart() {
        ShortList<Demand<double>, 8> demands;
        for (std::size_t k = 0; k < size(); ++k) {
            const ActingSurface<double, D>& one = surfaces_[k].is;
            const bool held = holds(one.contact, surfaces_[k].gap, reach_);
            const Vec<double, 3> n = in_space(one.normal);
            const double bound = dot(one.velocity, one.normal) - (held ? 0 : closing_speed(surfaces_[k].gap, dt_));
            demands.push_back({true, n, bound, n, 0, 0, false, k});
            if (held) demands.push_back({true, -n, -bound, n, 0, 0, true, k});
        }
        ShortList<double, 8> given;
        for (std::size_t i = 0; i < demands.size(); ++i) given.push_back(demands[i].bound);
        make_room(demands);
        for (std::size_t i = 0; i < demands.size(); ++i) {
            if (demands[i].bound == given[i]) continue;
            ActingSurface<double, D>& one = surfaces_[demands[i].surface].is;
            if (demands[i].pulls)
                one.contact = Contact::separate;  // it no longer holds matter back
            else
                one.velocity += one.normal * (demands[i].bound - given[i]);
        }
    }

    V before_;
    double reach_, dt_;
    ShortList<SurfaceByGap<D>, 8> surfaces_;
    ShortList<V, 8> changes_;
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
