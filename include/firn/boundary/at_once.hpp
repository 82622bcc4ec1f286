/// \file What all surfaces near a node do to its velocity, at once: walls, the parts of a boundary, the faces of a
/// shape.
///
/// The velocity changes as little as possible so that no surface is entered. This is the projection of the velocity
/// onto the set that all surfaces allow; at most three surfaces hold the result. Friction then acts along the surfaces
/// that hold it, of each in proportion to its own share of the impulse. So the order of the surfaces does not matter.
///
/// The projection is found by the dual method of Goldfarb and Idnani (1983), "A numerically stable dual method for
/// solving strictly convex quadratic programs": take the surface that is entered fastest, project onto it and those of
/// the surfaces before it that hold on, and so on.
#pragma once

#include <firn/boundary/contact.hpp>
#include <firn/core/repeat.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// A surface that acts on a node.
template <scalar S, int D>
struct ActingSurface {
    mask_t<S> acts;        ///< whether the surface acts on the node
    S distance;            ///< distance of the node from the surface [m], negative in the solid
    Vec<S, D> normal;      ///< unit normal of the surface, which points into free space [1]
    Vec<S, D> velocity;    ///< velocity of the solid at the node [m/s]
    Contact contact;       ///< how matter may move at the surface
    S friction;            ///< Coulomb's friction coefficient μ [1]
    bool is_wall = false;  ///< whether the surface lies across an axis and is at rest
};

/// A function object that can be called with any arguments and does nothing. Pass an AnySurface as `seen` where nothing
/// needs to be recorded.
struct AnySurface {
    /// Does nothing.
    template <class... Of>
    constexpr void operator()(const Of&...) const {}
};

namespace detail {

/// A list whose first N members need no memory from the heap.
template <class T, std::size_t N>
class ShortList {
public:
    ShortList() {}  // leaves the members uninitialised
    FIRN_INLINE void push_back(const T& one) {
        if (size_ < N)
            first_[size_] = one;
        else
            more_.push_back(one);
        ++size_;
    }
    FIRN_INLINE std::size_t size() const { return size_; }
    FIRN_INLINE T& operator[](std::size_t i) { return i < N ? first_[i] : more_[i - N]; }
    FIRN_INLINE const T& operator[](std::size_t i) const { return i < N ? first_[i] : more_[i - N]; }

private:
    std::size_t size_ = 0;
    T first_[N];
    std::vector<T> more_;
};

/// What a surface asks of the velocity w of a node: w · normal ≥ bound. Vectors have three components in 2D, too, so
/// that the formulas are the same.
template <scalar S>
struct Demand {
    mask_t<S> acts;       ///< whether the surface acts on the node
    Vec<S, 3> normal;     ///< unit vector [1]
    S bound;              ///< [m/s]
    Vec<S, 3> velocity;   ///< of the solid [m/s]
    S friction;           ///< μ [1]
    S rank;               ///< of demands that are missed by as much, the one with the lower rank comes first
    bool pulls;           ///< whether the surface keeps matter from leaving (`slip`); else it keeps it from entering
    std::size_t surface;  ///< index of the surface
};

/// A node's velocity, and the demands that hold it: at most three.
template <scalar S>
struct HeldNode {
    Vec<S, 3> velocity;               ///< [m/s]
    std::array<Vec<S, 3>, 3> normal;  ///< the normals of these demands
    Vec<S, 3> bound,                  ///< their bounds [m/s]
        number,                       ///< their indices in the list of demands
        push,                         ///< what each of them adds to the velocity along its normal [m/s]
        friction;                     ///< by how much the friction of each of them changes the velocity at most [m/s]
    S count;                          ///< how many they are

    /// Returns whether the i-th of these demands exists.
    FIRN_INLINE mask_t<S> has(int i) const { return S(i) < count; }
    /// Returns whether the i-th of these demands is the one with the index k in the list.
    FIRN_INLINE mask_t<S> is_held_by(std::size_t k, int i) const {
        const auto exists = has(i), is_that = number.v[i] == S(int(k));
        return exists & is_that;
    }
};

template <scalar S, class Mask>
FIRN_INLINE HeldNode<S> choose(const Mask& mask, const HeldNode<S>& a, const HeldNode<S>& b) {
    HeldNode<S> r;
    r.velocity = select(mask, a.velocity, b.velocity);
    for (std::size_t i = 0; i < 3; ++i) r.normal[i] = select(mask, a.normal[i], b.normal[i]);
    r.bound = select(mask, a.bound, b.bound);
    r.number = select(mask, a.number, b.number);
    r.push = select(mask, a.push, b.push);
    r.friction = select(mask, a.friction, b.friction);
    r.count = select(mask, a.count, b.count);
    return r;
}

/// A node, and what each demand has changed its velocity by: the state of a loop must have all that a pass changes.
template <scalar S>
struct SharedNode : HeldNode<S> {
    std::vector<Vec<S, 3>> shares;  ///< one for each demand in the list [m/s]
};

/// Returns a node that nothing holds.
template <scalar S>
FIRN_INLINE HeldNode<S> free_node(const Vec<S, 3>& velocity) {
    const auto zero = Vec<S, 3>::zero();
    return {velocity, {zero, zero, zero}, zero, zero, zero, zero, S(0)};
}

/// Finds the velocity nearest to a given one that all demands allow.
template <scalar S, int D>
class Projection {
    using V = Vec<S, 3>;

public:
    /// \param demands  at least one
    /// \param speed    the largest speed among those of the bounds and that of the node [m/s]
    Projection(const ShortList<Demand<S>, 8>& demands, const S& speed)
        : demands_(demands),
          tolerance_(speed * S(64 * double(std::numeric_limits<value_type_t<S>>::epsilon()))),
          largest_square_(speed * speed * S(fastest * fastest)) {}

    /// Returns the velocity nearest to v that all demands allow, and the demands that hold it.
    HeldNode<S> operator()(const V& v) const {
        // Each pass is farther from v than the one before, so that passes end. More than these are needed only where
        // many surfaces meet in one place, or where no velocity meets all demands.
        HeldNode<S> held = repeat_while<2 * D + 2>(free_node(v), [&](HeldNode<S>& node) FIRN_LAMBDA {
            const HeldNode<S> missed = most_missed(node.velocity);
            const auto any_missed = missed.has(0);
            if (any(any_missed)) node = choose(any_missed, with(missed, node, v), node);
            return any_missed;
        });
        set_pushes(held, v);
        return held;
    }

private:
    /// Returns a node that only the demand holds that the velocity w misses most, without its velocity; a node that no
    /// demand holds if there is none.
    FIRN_INLINE HeldNode<S> most_missed(const V& w) const {
        HeldNode<S> held = free_node(w);
        S by = tolerance_, rank = S(0);
        for (std::size_t k = 0; k < demands_.size(); ++k) {
            const Demand<S>& one = demands_[k];
            const S missed = one.bound - dot(one.normal, w);
            const mask_t<S> by_more = by < missed, comes_before = one.rank < rank, holds = held.has(0);
            const mask_t<S> as_much = (by == missed) & comes_before & holds, more = one.acts & (by_more | as_much);
            by = select(more, missed, by);
            rank = select(more, one.rank, rank);
            held.normal[0] = select(more, one.normal, held.normal[0]);
            held.bound.v[0] = select(more, one.bound, held.bound.v[0]);
            held.number.v[0] = select(more, S(int(k)), held.number.v[0]);
            held.count = select(more, S(1), held.count);
        }
        return held;
    }

    /// Returns whether the velocity w meets the i-th demand that holds a node, or whether there is none.
    FIRN_INLINE mask_t<S> meets(const V& w, const HeldNode<S>& node, int i) const {
        const auto is_missing = !node.has(i),
                   is_met = node.bound.v[i] - tolerance_ <= dot(w, node.normal[std::size_t(i)]);
        return is_missing | is_met;
    }
    /// Returns whether w meets both of two of them.
    FIRN_INLINE mask_t<S> meets(const V& w, const HeldNode<S>& node, int i, int j) const {
        const auto one = meets(w, node, i), other = meets(w, node, j);
        return one & other;
    }

    /// Returns the velocity nearest to v that the demand of `held` and those that hold `node` allow, where the former
    /// holds it.
    FIRN_INLINE HeldNode<S> with(HeldNode<S> held, const HeldNode<S>& node, const V& v) const {
        constexpr double least = 1e-8;  // square of the sine of the angle below which normals are parallel
        const V n = held.normal[0];
        const S bound = held.bound.v[0];
        const auto square_of_change = [&](const V& w) FIRN_LAMBDA { return dot(w - v, w - v); };
        held.velocity = v - n * (dot(v, n) - bound);
        const auto meets_two = meets(held.velocity, node, 0, 1), meets_third = meets(held.velocity, node, 2);
        const auto meets_all = meets_two & meets_third;
        constexpr double beyond_any = 1e30;  // [m²/s²]
        S nearest = select(meets_all, square_of_change(held.velocity), S(beyond_any));
        S first = S(-1), second = S(-1);  // which demands hold on
        const auto take = [&](const mask_t<S>& allowed, const V& w, int i, int j) FIRN_LAMBDA {
            const S square = square_of_change(w);
            const mask_t<S> is_slow = dot(w, w) <= largest_square_, better = allowed & (square < nearest) & is_slow;
            nearest = select(better, square, nearest);
            held.velocity = select(better, w, held.velocity);
            first = select(better, S(i), first);
            second = select(better, S(j), second);
        };
        for (int i = 0; i < D; ++i) {
            const V& other = node.normal[std::size_t(i)];
            const V edge = cross(n, other);
            const S square = dot(edge, edge);
            const mask_t<S> exists = node.has(i), crossed = S(least) < square, apart = exists & crossed;
            if (!any(apart)) continue;
            const V w = (cross(other, edge) * bound + cross(edge, n) * node.bound.v[i] + edge * dot(v, edge)) *
                        (S(1) / select(apart, square, S(1)));
            const auto meets_others = meets(w, node, (i + 1) % 3, (i + 2) % 3);
            take(apart & meets_others, w, i, -1);
        }
        for (int left_out = 0; D == 3 && left_out < 3; ++left_out) {
            const int i = left_out == 0 ? 1 : 0, j = left_out == 2 ? 1 : 2;
            const V &p = node.normal[std::size_t(i)], &q = node.normal[std::size_t(j)];
            const S determinant = dot(n, cross(p, q));
            const mask_t<S> exist = node.has(j), crossed = S(least) < determinant * determinant,
                            apart = exist & crossed;
            if (!any(apart)) continue;
            const V w = (cross(p, q) * bound + cross(q, n) * node.bound.v[i] + cross(n, p) * node.bound.v[j]) *
                        (S(1) / select(apart, determinant, S(1)));
            const auto meets_other = meets(w, node, left_out);
            take(apart & meets_other, w, i, j);
        }
        for (int place = 1; place < D; ++place)
            for (int i = 0; i < 3; ++i) {
                const auto keeps = (place == 1 ? first : second) == S(i);
                V& normal = held.normal[std::size_t(place)];
                normal = select(keeps, node.normal[std::size_t(i)], normal);
                held.bound.v[place] = select(keeps, node.bound.v[i], held.bound.v[place]);
                held.number.v[place] = select(keeps, node.number.v[i], held.number.v[place]);
                held.count = select(keeps, S(place + 1), held.count);
            }
        return held;
    }

    /// Sets what each demand adds to the velocity v of a node.
    FIRN_INLINE static void set_pushes(HeldNode<S>& held, const V& v) {
        const V change = held.velocity - v, &n = held.normal[0], &p = held.normal[1];
        const V edge = cross(n, p);
        const V third = select(held.has(2), held.normal[2], edge);
        const S determinant = dot(third, edge);
        const S per_determinant = S(1) / select(held.has(1), determinant, S(1));
        const auto push = [&](int i, const S& along) FIRN_LAMBDA { held.push.v[i] = select(held.has(i), along, S(0)); };
        push(0, select(held.has(1), dot(change, cross(p, third)) * per_determinant, dot(change, n)));
        push(1, dot(change, cross(third, n)) * per_determinant);
        push(2, dot(change, edge) * per_determinant);
    }

    /// Where surfaces that move leave only a narrow way out, they would shoot matter out. It gets no faster than so
    /// many times the fastest of them, and enters them.
    static constexpr double fastest = 5;

    const ShortList<Demand<S>, 8>& demands_;
    S tolerance_, largest_square_;
};

/// Returns the value nearest to x that friction towards two values leaves: it minimises
/// ½ (s − x)² + a |s − p| + b |s − q|.
/// \param a, b  by how much each friction changes x at most
template <scalar S>
FIRN_INLINE S slowed(const S& x, const S& p, const S& a, const S& q, const S& b) {
    const auto in_order = p <= q;
    const S low = select(in_order, p, q), high = select(in_order, q, p);
    const S towards_low = select(in_order, a, b), towards_high = select(in_order, b, a);
    const S between = min(max(x - towards_low + towards_high, low), high);
    return max(x - (a + b), min(x + (a + b), between));
}

/// The velocity of a node that several surfaces hold at once.
/// \tparam tells  whether what each demand changes the velocity by is wanted, too
template <scalar S, int D, bool tells>
class AtOnce {
    using V = Vec<S, 3>;
    using Node = std::conditional_t<tells, SharedNode<S>, HeldNode<S>>;

public:
    explicit AtOnce(const ShortList<Demand<S>, 8>& demands) : demands_(demands) {}

    /// Returns a node with the velocity that all demands allow, after friction.
    Node operator()(const V& v) const {
        Node start;
        static_cast<HeldNode<S>&>(start) = free_node(v);
        if constexpr (tells) start.shares.assign(demands_.size(), V::zero());
        if (demands_.size() == 0) return start;
        S largest = dot(v, v);
        bool rubs = false;
        for (std::size_t k = 0; k < demands_.size(); ++k) {
            const Demand<S>& one = demands_[k];
            largest = max(largest, select(one.acts, one.bound * one.bound, S(0)));
            rubs = any(one.acts & (S(0) < one.friction)) || rubs;
        }
        const Projection<S, D> project(demands_, sqrt(largest));
        if (!rubs) {
            static_cast<HeldNode<S>&>(start) = project(v);
            add_pushes(start, start);
            return start;
        }
        // Friction towards a solid that moves can push matter into another one.
        return repeat_while<4>(std::move(start), [&](Node& all) FIRN_LAMBDA {
            HeldNode<S>& node = all;
            const mask_t<S> is_free = !node.has(0), rubs_on = S(0) < largest_of(node.friction);
            HeldNode<S> next = project(rubbed(all));
            next.count = select(is_free | rubs_on, next.count, S(0));  // other lanes have their velocity
            add_pushes(all, next);
            next.friction = limits(next);
            node = choose(is_free | rubs_on, next, node);
            return S(0) < largest_of(node.friction);
        });
    }

private:
    FIRN_INLINE static S largest_of(const V& friction) { return max(friction.v[0], friction.v[1]); }

    /// Adds `change` to the share of the i-th demand that holds the node.
    FIRN_INLINE void add(std::vector<V>& shares, const HeldNode<S>& node, int i, const V& change) const {
        for (std::size_t k = 0; k < demands_.size(); ++k)
            shares[k] = select(node.is_held_by(k, i), shares[k] + change, shares[k]);
    }
    FIRN_INLINE void add_pushes([[maybe_unused]] Node& to, [[maybe_unused]] const HeldNode<S>& node) const {
        if constexpr (tells)
            for (int i = 0; i < 3; ++i) add(to.shares, node, i, node.normal[std::size_t(i)] * node.push.v[i]);
    }

    /// Returns by how much the friction of each demand changes the velocity at most [m/s].
    FIRN_INLINE V limits(const HeldNode<S>& node) const {
        V limit = V::zero();
        for (std::size_t k = 0; k < demands_.size(); ++k)
            for (int i = 0; i < 2; ++i)
                limit.v[i] =
                    select(node.is_held_by(k, i), demands_[k].friction * max(node.push.v[i], S(0)), limit.v[i]);
        return limit;
    }

    /// Returns the velocity after friction: in the plane of the one surface that holds the node, or along the edge
    /// between two.
    FIRN_INLINE V rubbed(Node& node) const {
        V solid = V::zero(), other_solid = V::zero();  // their velocities
        for (std::size_t k = 0; k < demands_.size(); ++k) {
            solid = select(node.number.v[0] == S(int(k)), demands_[k].velocity, solid);
            other_solid = select(node.number.v[1] == S(int(k)), demands_[k].velocity, other_solid);
        }
        const V& n = node.normal[0];
        const auto on_two = node.has(1);

        const V relative = node.velocity - solid, tangential = relative - n * dot(relative, n);
        const S speed = sqrt(max(dot(tangential, tangential), S(detail::least_square)));
        const V in_plane = tangential * (max(speed - node.friction.v[0], S(0)) / speed - S(1));

        const V across = cross(n, node.normal[1]);
        const S square = dot(across, across);
        const V edge = across * (S(1) / sqrt(select(on_two, square, S(1))));
        const S along = dot(node.velocity, edge), p = dot(solid, edge), q = dot(other_solid, edge);
        const S a = node.friction.v[0], b = select(on_two, node.friction.v[1], S(0));
        const S after = slowed(along, p, a, q, b);
        const S change = select(node.has(2), S(0), after - along);
        if constexpr (tells) {
            // A friction that does not stop the node is as large as it can be; the others share the rest.
            const auto full = [&](const S& towards, const S& limit) FIRN_LAMBDA {
                return select(after < towards, limit, select(towards < after, -limit, S(0)));
            };
            const auto part = [&](const S& towards, const S& limit)
                                  FIRN_LAMBDA { return select(after == towards, limit, S(0)); };
            const S parts = part(p, a) + part(q, b), rest = change - full(p, a) - full(q, b);
            const S per_part = select(S(0) < parts, rest / select(S(0) < parts, parts, S(1)), S(0));
            const auto slides = on_two & !node.has(2);
            add(node.shares, node, 0,
                select(on_two, edge * select(slides, full(p, a) + part(p, a) * per_part, S(0)), in_plane));
            add(node.shares, node, 1, edge * select(slides, full(q, b) + part(q, b) * per_part, S(0)));
        }
        return node.velocity + select(on_two, edge * change, in_plane);
    }

    const ShortList<Demand<S>, 8>& demands_;
};

/// Returns v with three components.
template <scalar S, int D>
FIRN_INLINE Vec<S, 3> in_space(const Vec<S, D>& v) {
    if constexpr (D == 3)
        return v;
    else
        return {v.v[0], v.v[1], S(0)};
}

/// A surface that acts on a node, and what a NodeAtSurfaces needs to know besides.
template <scalar S, int D>
struct SurfaceOfNode {
    ActingSurface<S, D> is;
    S open;    ///< speed at which matter may approach the surface [m/s]
    int part;  ///< index of the part of the boundary
};
template <scalar S, int D>
using SurfacesOfNode = ShortList<SurfaceOfNode<S, D>, 8>;

/// Where two surfaces close on each other, no velocity meets both demands. There matter moves with the slower one of
/// the two, and rests where they come from both sides. Where a surface that holds matter back leaves, and another one
/// pushes, the other one is followed.
template <scalar S>
void make_room(ShortList<Demand<S>, 8>& demands) {
    constexpr double opposite = -0.9;  // cosine; between normals that differ more, matter finds a way out
    ShortList<S, 8> given;
    for (std::size_t i = 0; i < demands.size(); ++i) given.push_back(demands[i].bound);
    for (std::size_t i = 0; i < demands.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            Demand<S>&a = demands[i], &b = demands[j];
            if (a.surface == b.surface) continue;
            const auto closing = S(0) < given[i] + given[j], opposed = dot(a.normal, b.normal) < S(opposite);
            const auto close = a.acts & b.acts & closing & opposed;
            if (!any(close)) continue;
            const S shared = a.pulls == b.pulls ? min(max(S(0), -given[j]), given[i]) : a.pulls ? -given[j] : given[i];
            a.bound = select(close, min(a.bound, S(0) + shared), a.bound);
            b.bound = select(close, min(b.bound, S(0) - shared), b.bound);
        }
}

/// Returns the velocity of a node on which several surfaces act [m/s]. It is not inlined: few nodes need it.
/// \param before  velocity of the node before they act [m/s]
/// \param after   if `tells` is true, receives for each surface the velocity that its share of the change leads to
template <bool tells, scalar S, int D>
[[gnu::noinline]] Vec<S, D> held_at_once(const SurfacesOfNode<S, D>& surfaces, const Vec<S, D>& before,
                                         [[maybe_unused]] Vec<S, D>* after) {
    ShortList<Demand<S>, 8> demands;
    Vec<S, D> stuck = Vec<S, D>::zero();  // the last surface that sticks decides
    mask_t<S> sticks = S(1) < S(0);
    S stuck_to = S(0);
    bool rest = true, smooth = true;  // whether all are walls, and none has friction
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        const ActingSurface<S, D>& one = surfaces[i].is;
        if (one.contact == Contact::stick) {
            stuck = select(one.acts, one.velocity, stuck);
            stuck_to = select(one.acts, S(int(i)), stuck_to);
            sticks = sticks | one.acts;
            continue;
        }
        rest = rest && one.is_wall;
        smooth = smooth && !any(S(0) < one.friction);
        const Vec<S, 3> n = in_space(one.normal), of_solid = in_space(one.velocity);
        const S bound = one.is_wall ? -surfaces[i].open : dot(of_solid, n) - surfaces[i].open;
        const S rank = dot(n, {S(0.13), S(0.71), S(0.37)}) + dot(of_solid, {S(0.29), S(0.53), S(0.17)}) - one.friction;
        demands.push_back({one.acts, n, bound, of_solid, one.friction, rank, false, i});
        if (one.contact == Contact::slip) demands.push_back({one.acts, -n, -bound, of_solid, S(0), -rank, true, i});
    }
    [[maybe_unused]] std::vector<Vec<S, 3>> shares;
    Vec<S, 3> held = in_space(before);
    if (rest && smooth) {  // they are at right angles: what one changes, the others do not
        if constexpr (tells) shares.assign(demands.size(), Vec<S, 3>::zero());
        for (std::size_t k = 0; k < demands.size(); ++k) {
            const Demand<S>& one = demands[k];
            const Vec<S, 3> change = one.normal * max(one.bound - dot(one.normal, held), S(0));
            held = select(one.acts, held + change, held);
            if constexpr (tells) shares[k] = select(one.acts, change, shares[k]);
        }
    } else {
        if (!rest) make_room(demands);
        auto node = AtOnce<S, D, tells>(demands)(held);
        held = node.velocity;
        if constexpr (tells) shares = std::move(node.shares);
    }
    if constexpr (tells) {
        for (std::size_t i = 0; i < surfaces.size(); ++i) after[i] = before;
        for (std::size_t k = 0; k < demands.size(); ++k)
            unroll<D>([&](auto a) FIRN_LAMBDA { after[demands[k].surface].v[a] += shares[k].v[a]; });
        for (std::size_t i = 0; i < surfaces.size(); ++i)
            after[i] = select(sticks, select(stuck_to == S(int(i)), stuck, before), after[i]);
    }
    Vec<S, D> velocity = before;
    unroll<D>([&](auto a) FIRN_LAMBDA { velocity.v[a] = select(sticks, stuck.v[a], held.v[a] + S(0)); });  // no −0
    return velocity;
}

}  // namespace detail

/// The surfaces that act on a node, and what they do to its velocity, at once.
template <scalar S, int D>
class NodeAtSurfaces {
    using V = Vec<S, D>;

public:
    /// \param v  velocity of the node before any surface acts [m/s]
    FIRN_INLINE explicit NodeAtSurfaces(const V& v)
        : before_(v), alone_(v), touched_(S(1) < S(0)), touched_twice_(touched_) {}

    /// Adds a surface.
    /// \param part   index of the part of the boundary that the surface belongs to
    /// \param alone  velocity of the node if this surface acts alone [m/s]
    /// \param open   speed at which matter may approach the surface [m/s]
    FIRN_INLINE void add(int part, const ActingSurface<S, D>& surface, const V& alone, const S& open = S(0)) {
        alone_ = select(surface.acts, alone, alone_);
        touched_twice_ = touched_twice_ | (touched_ & surface.acts);
        touched_ = touched_ | surface.acts;
        surfaces_.push_back({surface, open, part});
    }
    /// Adds a surface that the node touches.
    FIRN_INLINE void add(int part, const ActingSurface<S, D>& surface) {
        if (surface.contact == Contact::none || !any(surface.acts)) return;
        if (surface.is_wall) {
            add(part, surface, velocity_after_contact(before_, surface.normal, surface.contact, surface.friction));
        } else {
            const V relative = before_ - surface.velocity;
            add(part, surface,
                surface.velocity + velocity_after_contact(relative, surface.normal, surface.contact, surface.friction));
        }
    }

    /// Returns the velocity of the node [m/s] after all surfaces have acted.
    /// \param seen  a function, called as seen(part, before, after) for every surface, with the velocities of the node
    ///              before and after this surface acts. The sum of the changes is the whole change
    template <class Seen>
    FIRN_INLINE V velocity(const Seen& seen) const {
        constexpr bool tells = !std::same_as<Seen, AnySurface>;
        if (!any(touched_twice_)) {
            if constexpr (tells)
                for (std::size_t i = 0; i < surfaces_.size(); ++i)
                    seen(surfaces_[i].part, before_, select(surfaces_[i].is.acts, alone_, before_));
            return alone_;
        }
        const V before = before_;
        if constexpr (!tells) {
            const V together = detail::held_at_once<false>(surfaces_, before, static_cast<V*>(nullptr));
            return select(touched_twice_, together, alone_);
        } else {
            const std::size_t count = surfaces_.size();
            std::vector<V> all(2 * count);  // where several surfaces act at once; then, where at most one does
            const V together = detail::held_at_once<true>(surfaces_, before, all.data());
            for (std::size_t i = 0; i < count; ++i) all[count + i] = select(surfaces_[i].is.acts, alone_, before_);
            // The choices follow each other: so they become one branch of a program for a GPU.
            const V velocity = select(touched_twice_, together, alone_);
            for (std::size_t i = 0; i < count; ++i) all[i] = select(touched_twice_, all[i], all[count + i]);
            for (std::size_t i = 0; i < count; ++i) seen(surfaces_[i].part, before_, all[i]);
            return velocity;
        }
    }

private:
    V before_, alone_;  // velocities: before, and where at most one surface acts
    mask_t<S> touched_, touched_twice_;
    detail::SurfacesOfNode<S, D> surfaces_;
};

}  // namespace firn::inline FIRN_BUILD
