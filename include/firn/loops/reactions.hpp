/// \file Reactions: the impulses and angular impulses of boundaries on matter, for diagnostics and two-way coupling.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/core/error.hpp>
#include <firn/core/exact_sum.hpp>
#include <firn/core/lanes.hpp>
#include <firn/loops/ranks_of.hpp>
#include <firn/math/rotor.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The impulse and the angular impulse of one part of a boundary on matter in a step, summed over the nodes: Σ m Δv and
/// Σ (x − about) × m Δv. m is the mass and x the position of a node, and Δv is this part's share of the change of the
/// node's velocity: where several surfaces act at once, what it pushes along its normal, and its friction. The shares
/// of all parts add up to the whole change. Matter exerts the opposite impulse on the part: the mean force on the part
/// during a step of dt is −impulse / dt.
template <int D>
struct Reaction {
    Vec<double, D> about = Vec<double, D>::zero();          ///< the point about which angular impulses are taken [m]
    Vec<double, D> impulse = Vec<double, D>::zero();        ///< Σ m Δv [N s]
    Axial<double, D> angular_impulse = Axial<double, D>{};  ///< Σ (x − about) × m Δv [N m s]

    /// Adds the impulses of the reaction `more`, which must have the same point `about`.
    Reaction& operator+=(const Reaction& more) {
        impulse += more.impulse;
        angular_impulse += more.angular_impulse;
        return *this;
    }
};

/// The name of a load, which SetAccess::add_load() returns. It stays the name of this load.
struct LoadId {
    std::uint32_t material = 0,  ///< index of the material in the list of materials
        number = 0;              ///< how many loads of this material were added before

    bool operator==(const LoadId&) const = default;
};

/// What a load exerted on matter in a step.
template <int D>
struct LoadReaction {
    LoadId load;           ///< the load
    Reaction<D> reaction;  ///< its impulse and angular impulse, summed over the particles
};

/// The reactions of all parts of a boundary, computed by grid_update(). A boundary of class Together or BoundaryList
/// has several parts. The impulses on the nodes of a block are summed in double. The sums over blocks are exact and are
/// rounded once, so reactions have the same bits for any number of threads and ranks, and for any order of the blocks.
/// \see ExactSum
template <int D>
struct Reactions {
    /// The point about which angular impulses are taken [m]. If it is not given, the point of each part is the position
    /// of the part, or the origin if the part has no position.
    std::optional<Vec<double, D>> about{};
    std::vector<Reaction<D>> parts{};  ///< One reaction for each part, in the order of the parts.
    /// One for each load that acted in the step, by a Simulation only, in the order of the materials and of add_load().
    /// The sums over particles are exact and rounded once, too.
    std::vector<LoadReaction<D>> loads{};

    /// Returns what a load exerted on matter in the last step.
    /// \throws parameter_error  if the load did not act in that step
    const Reaction<D>& of(const LoadId& load) const {
        for (const LoadReaction<D>& one : loads)
            if (one.load == load) return one.reaction;
        throw parameter_error(sentence("Load ", load.number, " of material ", load.material,
                                       " did not act in the last step: it was removed, or added after the step. Give "
                                       "what add_load() has returned, and step() with `reactions` first."));
    }
};

namespace detail {

/// Calls f(q) for each component q of the impulse and of the angular impulse of a reaction.
template <class Of, class F>
void for_impulses(Of& reaction, const F& f) {
    constexpr int D = int(std::extent_v<decltype(reaction.impulse.v)>);
    for (int a = 0; a < D; ++a) f(reaction.impulse[a]);
    if constexpr (D == 2)
        f(reaction.angular_impulse);
    else
        for (int a = 0; a < D; ++a) f(reaction.angular_impulse[a]);
}

/// Adds the impulse of a part of a boundary on matter at one node to a reaction.
/// \param x  position of the node [m];  \param mass  its mass [kg];  \param change  of its velocity [m/s]
template <int D>
FIRN_INLINE void add_impulse(Reaction<D>& sum, const Vec<double, D>& x, double mass, const Vec<double, D>& change) {
    const Vec<double, D> impulse = change * mass;
    sum.impulse += impulse;
    sum.angular_impulse += axial_product(x - sum.about, impulse);
}

/// Prepares the reactions of a boundary: one for each part, without impulses.
template <int D, class Boundary>
void begin_reactions(Reactions<D>& reactions, const Boundary& boundary) {
    const auto parts = std::size_t(part_count(boundary));
    reactions.parts.assign(parts, {});
    for (std::size_t k = 0; k < parts; ++k)
        reactions.parts[k].about = reactions.about ? *reactions.about : part_centre<D>(boundary, int(k));
}

/// Adds the impulse of a part of a boundary on matter at some nodes to a reaction.
/// \param corner  the point from which positions are measured [m]
template <class P, int D>
[[gnu::noinline, gnu::cold]] void add_impulses(Reaction<D>& sum, Vec<P, D> x, Vec<P, D> before, Vec<P, D> after, P mass,
                                               const Vec<double, D>& corner) {
    for (int lane = 0; lane < scalar_traits<P>::lanes; ++lane) {
        Vec<double, D> at{}, change{};
        for (int a = 0; a < D; ++a) {
            at[a] = double(lane_value(x[a], lane)) + corner[a];
            change[a] = double(lane_value(after[a], lane)) - double(lane_value(before[a], lane));
        }
        add_impulse(sum, at, double(lane_value(mass, lane)), change);
    }
}

/// A boundary that changes velocities as `boundary` does. It also adds the impulse of each part of `boundary` on matter
/// to `parts`, unless this is nullptr. Positions are measured from `corner` [m].
template <scalar P, int D, class Boundary>
struct Watched {
    const Boundary& boundary;
    const P& mass_of_node;  // 0 for a node without matter
    Reaction<D>* parts;
    const Vec<double, D>& corner;

    FIRN_INLINE Vec<P, D> velocity(const Vec<P, D>& x, const Vec<P, D>& v, const P& mass, const P& dt) const {
        const auto add = [&](int part, const Vec<P, D>& before, const Vec<P, D>& after) FIRN_LAMBDA {
            if (parts) add_impulses(parts[part], x, before, after, mass_of_node, corner);
        };
        return velocity_among(boundary, x, v, NoOthers{}, add, NodeInertia<P>{mass, dt});
    }
};

/// Sums the reactions of blocks and of all ranks, part by part. Each sum is exact and rounded once.
/// \param of_blocks  one Reaction for each part, block after block
/// \param parts      receives the impulses; the points `about` are kept
template <int D>
void sum_reactions(const RankSums& ranks, std::span<const Reaction<D>> of_blocks, std::span<Reaction<D>> parts) {
    constexpr std::size_t numbers = D + (D == 2 ? 1 : D);
    std::vector<ExactSum> sums(parts.size() * numbers);
    for (std::size_t i = 0; i < of_blocks.size(); ++i) {
        ExactSum* sum = sums.data() + i % parts.size() * numbers;
        for_impulses(of_blocks[i], [&](double impulse) {
            if (impulse != 0) sum->add(impulse);
            ++sum;
        });
    }
    ranks.merge(sums);
    const ExactSum* sum = sums.data();
    for (Reaction<D>& part : parts) for_impulses(part, [&](double& impulse) { impulse = (sum++)->value(); });
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
