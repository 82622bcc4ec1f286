/// \file The pass in which rigid bodies and matter push each other. It takes the place of act_by_gap().
///
/// What the surfaces of a boundary do to a node depends on the velocities of bodies at the end of the step, and these
/// on what matter does to the bodies: with the velocities u of a body's motions, its inertia M, the impulses R(u) of
/// the body on matter and the velocities u* without contact,
///
///     M (u − u*) + R(u) = dt f(u)
///
/// where f is the force of the drive. Where gaps, normals and masses of nodes are found once, R is cheap. Without
/// friction the equation says that a convex energy, ½ |u − u*|² of the body and ½ |Δv|² of the nodes, is least, so that
/// contact never adds energy. It is solved by Newton's method, for each body with the others as they are. Surfaces act
/// in turn where a body is among them, so that R has no jumps. \see boundary/in_turn.hpp. Bodies get the impulses that
/// nodes got, so that momenta are conserved however far it is solved. Sums over nodes are exact and rounded once. \see
/// ExactSum
#pragma once

#include <firn/boundary/in_turn.hpp>
#include <firn/core/error.hpp>
#include <firn/loops/flow_at_body.hpp>
#include <firn/loops/gap_contact.hpp>
#include <firn/loops/moving_body.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A node that surfaces may act on.
template <int D>
struct NodeByGap {
    Vec<double, D> x{}, v{};                ///< position [m] and velocity before contact [m/s]
    double mass = 0;                        ///< [kg]
    int node = 0;                           ///< index in its block
    std::uint32_t first = 0, surfaces = 0;  ///< its surfaces in the list of its block
    bool has_body = false;                  ///< whether one of them is a body's
};
/// A surface near a node, and how its velocity along its normal goes on to the node. \see RigidBody::in_flow
template <int D>
struct NotedSurface : SurfaceByGap<D> {
    FlowAtNode goes_on{};
};
/// What surfaces may do in one block. It does not depend on the velocities of bodies.
template <int D>
struct BlockByGap {
    std::vector<NodeByGap<D>> nodes{};
    std::vector<NotedSurface<D>> surfaces{};
    std::vector<std::size_t> bodies{};  ///< whose surfaces are among them
};

/// Notes the surfaces that may act on a node, with their gaps: a function like ActByGap.
template <int D, class Nearest>
struct NoteGaps {
    const ActByGap<D, Nearest>& act;
    std::vector<NotedSurface<D>>& surfaces;

    template <class... Look>
    void add(NodeAtSurfaces<double, D>&, int part, const Vec<double, D>&, ActingSurface<double, D> surface,
             const Look&... look) const {
        if (surface.contact == Contact::none || !surface.acts) return;
        const double gap = act.gap_to(surface.distance, surface.normal, look...);
        if (gap < act.none) surfaces.push_back({{surface, gap, part}});
    }
};

/// How a body moves at `arm` from its centre: J with the velocity J u there, column by column.
template <int D>
std::array<Vec<double, D>, std::size_t(MovingBody<D>::n)> motions_at(const Vec<double, D>& arm) {
    std::array<Vec<double, D>, std::size_t(MovingBody<D>::n)> J{};
    for (int a = 0; a < D; ++a) J[std::size_t(a)][a] = 1;
    if constexpr (D == 2) {
        J[2] = {-arm[1], arm[0]};
    } else {
        for (std::size_t a = 0; a < 3; ++a) J[3 + a] = cross(J[a], arm);
    }
    return J;
}
/// What a body does to the matter of one block: R(u).
template <int D>
struct PushOfBody {
    std::size_t body;
    Motions<D> impulse = Motions<D>::zero();  ///< [N s], [N m s]
    /// Adds the change of the velocity of a node at `arm` from the centre.
    void add(const Vec<double, D>& arm, double mass, const Vec<double, D>& change) {
        const auto J = motions_at<D>(arm);
        for (std::size_t i = 0; i < J.size(); ++i) impulse[int(i)] += dot(J[i], change) * mass;
    }
};
/// The derivative ∂R/∂u of this.
template <int D>
struct SlopeOfBody {
    std::size_t body;
    typename MovingBody<D>::Matrix slope = {};
    /// Adds the derivative of that change by the velocity of the body there.
    void add(const Vec<double, D>& arm, double mass, const Mat<double, D>& by_velocity) {
        const auto J = motions_at<D>(arm);
        for (std::size_t j = 0; j < J.size(); ++j) {
            const Vec<double, D> by = by_velocity * J[j] * mass;
            for (std::size_t i = 0; i < J.size(); ++i) slope[i][int(j)] += dot(J[i], by);
        }
    }
};

/// Does the work of act_with_bodies().
template <class Kernel, std::floating_point S, int D>
class RigidContact {
    using Body = MovingBody<D>;
    static constexpr int n = Body::n;

public:
    RigidContact(int threads, const RankSums& ranks, SparseGrid<S, D>& grid, GapMemory<Kernel, S, D>& memory, double dt,
                 std::vector<Body>& bodies)
        : threads_(threads), ranks_(ranks), grid_(grid), memory_(memory), dt_(dt), bodies_(bodies) {
        blocks_.resize(memory.places().size());
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            body_of_part_.resize(std::max(body_of_part_.size(), std::size_t(bodies[b].part) + 1), none);
            body_of_part_[std::size_t(bodies[b].part)] = b;
        }
    }

    /// Notes which surfaces may act on the nodes of place i, and their gaps. \param boundary  in double
    template <class Boundary>
    void note(std::size_t i, const Boundary& boundary, AroundBlock<Kernel, D>& around) {
        std::uint64_t nodes = memory_.nodes[i];
        if (nodes == 0) return;
        const auto& place = memory_.places()[i];
        BlockByGap<D>& block = blocks_[i];
        const double h = grid_.domain().cell_size;
        memory_.near().gather(place.near, nodes, around);
        for (; nodes != 0; nodes &= nodes - 1) {
            const int node = std::countr_zero(nodes);
            const AroundNode<Kernel, D> at_node(around, node);
            if (at_node.size() == 0) continue;
            const S* const values = grid_.nodes(place.block) + node * node_width;
            NodeByGap<D> one{.x = node_position(grid_, place.block, node),
                             .mass = double(values[node_mass]),
                             .node = node,
                             .first = std::uint32_t(block.surfaces.size())};
            for (int a = 0; a < D; ++a) one.v[a] = double(values[a]);
            const auto nearest = [&](const Vec<double, D>& normal) {
                return h * Separator<Kernel, D>::depth(at_node, normal);
            };
            const ActByGap<D, decltype(nearest)> act{h, dt_, nearest};
            velocity_by_gap<Boundary, D>(boundary, one.x, one.v, NoteGaps<D, decltype(nearest)>{act, block.surfaces},
                                         AnySurface{});
            one.surfaces = std::uint32_t(block.surfaces.size()) - one.first;
            // Walls and solids with given motions come last, and have the last word: matter must not enter them.
            const auto first = block.surfaces.begin() + one.first;
            auto others = first;
            for (auto surface = first; surface != block.surfaces.end(); ++surface)
                if (body_of(surface->part) != none) std::rotate(others++, surface, surface + 1);
            one.has_body = others != first;
            for (auto surface = first; surface != others; ++surface)
                if (const auto& layer = bodies_[body_of(surface->part)].layer)
                    surface->goes_on = FlowAtBody<S, D>(grid_).at(place.block, one.x, surface->is.distance,
                                                                  surface->is.normal, h * *layer);
            if (one.surfaces > 0) block.nodes.push_back(one);
        }
    }

    /// Finds the velocities of the bodies. \return whether all residuals became small
    bool solve() {
        prepare();
        evaluate(true);
        std::vector<Trial> trials(bodies_.size());
        for (int iteration = 0; iteration < most_iterations; ++iteration) {
            for (std::size_t b = 0; b < bodies_.size(); ++b) {
                moves_[b] = !is_small(b) && trials[b].failures < most_failures;
                needs_slope_[b] = moves_[b] && !(squares_[b] < well * trials[b].square);
            }
            if (!any(moves_)) break;
            if (any(needs_slope_)) find_slopes();
            for (std::size_t b = 0; b < bodies_.size(); ++b)
                if (moves_[b])
                    trials[b] = {bodies_[b].velocity, solved<n>(bodies_[b].derivatives(slopes_[b]), residuals_[b]),
                                 squares_[b], 1, trials[b].failures};
            improve(trials);
        }
        bool all_small = true;
        for (std::size_t b = 0; b < bodies_.size(); ++b) all_small = all_small && squares_[b] <= 1e-12 * scales_[b];
        return all_small;
    }

    /// Lets the surfaces act on the nodes of place i. \param reactions  one for each part, or nullptr
    void act(std::size_t i, Reaction<D>* reactions) {
        const auto& place = memory_.places()[i];
        const BlockByGap<D>& block = blocks_[i];
        for (const NodeByGap<D>& one : block.nodes) {
            const auto see = [&](int part, const Vec<double, D>& change) {
                if (reactions) add_impulse(reactions[part], one.x, one.mass, change);
            };
            const Vec<double, D> after =
                one.has_body ? beside_bodies(block, one, see) : between_others(block, one, see);
            S* const values = grid_.nodes(place.block) + one.node * node_width;
            for (int a = 0; a < D; ++a) values[a] = S(after[a]);
        }
    }

private:
    static constexpr std::size_t none = std::size_t(-1);
    static constexpr int most_iterations = 30, most_halvings = 4, most_failures = 8;
    static constexpr double well = 1e-4;  // how far the square of a residual falls if the derivatives still do
    static constexpr double blind_part = 0.25;

    /// A step of Newton's method for one body.
    struct Trial {
        Motions<D> start = Motions<D>::zero(), step = Motions<D>::zero();  ///< velocities
        double square = 0;                                                 ///< of the residual at the start [J]
        double part = 0;                                                   ///< of the step that is taken
        int failures = 0;                                                  ///< how many steps did not help
    };
    using Flags = std::vector<std::uint8_t>;  // one for each body
    static bool any(const Flags& of) { return std::find(of.begin(), of.end(), true) != of.end(); }
    /// Moves bodies along their steps. Each step is halved until the residual of its body falls. If it does not, where
    /// matter begins or ends to slide or to touch, a part of the step is taken all the same: it leads past that place.
    void improve(std::vector<Trial>& trials) {
        const auto is_left = [&](std::size_t b) {
            return moves_[b] && !(squares_[b] < trials[b].square) && !is_small(b);
        };
        const auto place = [&](std::size_t b) {
            bodies_[b].velocity = trials[b].start - trials[b].step * trials[b].part;
        };
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (moves_[b]) place(b);
        evaluate(true);
        Flags is_shorter(bodies_.size());
        for (int halving = 0; halving < most_halvings; ++halving) {
            for (std::size_t b = 0; b < bodies_.size(); ++b) {
                moves_[b] = is_left(b);
                if (!moves_[b]) continue;
                is_shorter[b] = true;
                trials[b].part /= 2;
                place(b);
            }
            if (!any(moves_)) break;
            evaluate(false);
        }
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (is_left(b)) {
                trials[b].part = ++trials[b].failures < most_failures ? blind_part : 0;
                place(b);
            }
        moves_ = is_shorter;
        if (any(moves_)) evaluate(true);
    }

    /// Whether the residual of a body is small. Squares of residuals and scales are energies [J].
    bool is_small(std::size_t b) const { return !(squares_[b] > 1e-20 * scales_[b]); }
    /// Returns ½ pᵀ M⁻¹ p [J].
    static double energy(const Body& body, const Motions<D>& p) {
        return 0.5 * dot(p, product<n>(body.inverse_inertia, p));
    }
    std::size_t body_of(int part) const {
        return std::size_t(part) < body_of_part_.size() ? body_of_part_[std::size_t(part)] : none;
    }

    /// How much faster than it is a body is taken to be, where derivatives are found by differences.
    struct Faster {
        std::size_t body = none;
        Vec<double, D> by = Vec<double, D>::zero();  ///< [m/s]
    };
    /// Returns the surfaces of a node, with the present velocities of bodies.
    NodeInTurn<D> in_turn(const BlockByGap<D>& block, const NodeByGap<D>& one, const Faster& faster = {}) const {
        NodeInTurn<D> node(one.v, boundary_reach * grid_.domain().cell_size, dt_);
        for (std::uint32_t k = 0; k < one.surfaces; ++k) {
            NotedSurface<D> surface = block.surfaces[one.first + k];
            if (const std::size_t b = body_of(surface.part); b != none) {
                surface.is.velocity = bodies_[b].velocity_at(one.x);
                if (b == faster.body) surface.is.velocity += faster.by;
                if (const auto& [part, flow] = surface.goes_on; part != 1)
                    surface.is.velocity +=
                        surface.is.normal * ((part - 1) * dot(surface.is.velocity, surface.is.normal) + flow);
            }
            node.add(surface);
        }
        return node;
    }
    /// Returns the velocity of a node that a body may touch, after its surfaces have acted.
    /// \param see  a function, called as see(part, change of the velocity) for each surface
    template <class See>
    Vec<double, D> beside_bodies(const BlockByGap<D>& block, const NodeByGap<D>& one, const See& see) const {
        NodeInTurn<D> node = in_turn(block, one);
        const Vec<double, D> after = node.velocity();
        for (std::uint32_t k = 0; k < one.surfaces; ++k) see(block.surfaces[one.first + k].part, node.change(k));
        return after;
    }
    /// Returns the velocity of another node after its surfaces have acted.
    template <class See>
    Vec<double, D> between_others(const BlockByGap<D>& block, const NodeByGap<D>& one, const See& see) const {
        static constexpr int no_matter = 0;
        const ActByGap<D, int> act{grid_.domain().cell_size, dt_, no_matter};
        NodeAtSurfaces<double, D> node(one.v);
        for (std::uint32_t k = 0; k < one.surfaces; ++k) {
            const SurfaceByGap<D>& surface = block.surfaces[one.first + k];
            act.add_at(node, surface.part, one.v, surface.is, surface.gap);
        }
        return node.velocity(
            [&](int part, const Vec<double, D>& before, const Vec<double, D>& after) { see(part, after - before); });
    }

    /// Finds what bodies do to the matter of place i.
    void find_pushes(std::size_t i, std::vector<PushOfBody<D>>& pushes) const {
        const BlockByGap<D>& block = blocks_[i];
        pushes.clear();
        for (const NodeByGap<D>& one : block.nodes) {
            if (!one.has_body) continue;
            beside_bodies(block, one, [&](int part, const Vec<double, D>& change) {
                const std::size_t b = body_of(part);
                if (b != none && dot(change, change) > 0)
                    of_body(pushes, b).add(one.x - bodies_[b].centre, one.mass, change);
            });
        }
    }
    /// Finds the derivatives of what those bodies do that need them.
    void find_slopes(std::size_t i, std::vector<SlopeOfBody<D>>& slopes) const {
        const BlockByGap<D>& block = blocks_[i];
        slopes.clear();
        for (const NodeByGap<D>& one : block.nodes) {
            if (!one.has_body) continue;
            std::uint32_t k = 0;
            beside_bodies(block, one, [&](int part, const Vec<double, D>& change) {
                const std::uint32_t surface = k++;
                const std::size_t b = body_of(part);
                if (b != none && needs_slope_[b] && dot(change, change) > 0)
                    of_body(slopes, b).add(one.x - bodies_[b].centre, one.mass, slope_of(block, one, surface, change));
            });
        }
    }
    /// Returns the place for what a body does.
    template <class Of>
    static Of& of_body(std::vector<Of>& all, std::size_t body) {
        const auto mine = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.body == body; });
        return mine == all.end() ? *all.insert(mine, Of{.body = body}) : *mine;
    }
    /// Returns the derivative of what surface k changes a node's velocity by, by the velocity of its body there. It is
    /// found by differences, which Newton's method does not notice.
    Mat<double, D> slope_of(const BlockByGap<D>& block, const NodeByGap<D>& one, std::uint32_t k,
                            const Vec<double, D>& change) const {
        const std::size_t b = body_of(block.surfaces[one.first + k].part);
        const double step = 1e-7 * (norm(one.v) + norm(bodies_[b].velocity_at(one.x)) + norm(change));
        auto slope = Mat<double, D>::zero();
        for (int a = 0; a < D; ++a) {
            Faster faster{.body = b};
            faster.by[a] = step;
            NodeInTurn<D> node = in_turn(block, one, faster);
            node.velocity();
            const Vec<double, D> by = (node.change(k) - change) * (1 / step);
            for (int i = 0; i < D; ++i) slope(i, a) = by[i];
        }
        return slope;
    }

    /// Finds the bodies that have matter near them, on any rank: those for which sums are needed. Lets all move.
    void prepare() {
        std::vector<ExactSum> counts(bodies_.size());
        for (BlockByGap<D>& block : blocks_) {
            for (const SurfaceByGap<D>& surface : block.surfaces)
                if (const std::size_t b = body_of(surface.part); b != none) block.bodies.push_back(b);
            std::sort(block.bodies.begin(), block.bodies.end());
            block.bodies.erase(std::unique(block.bodies.begin(), block.bodies.end()), block.bodies.end());
            for (const std::size_t b : block.bodies) counts[b].add(1);
        }
        ranks_.merge(counts);
        is_touched_.resize(bodies_.size());
        for (std::size_t b = 0; b < bodies_.size(); ++b) is_touched_[b] = counts[b].value() > 0;
        moves_.assign(bodies_.size(), true), needs_slope_.resize(bodies_.size());
        pushes_.resize(blocks_.size()), push_slopes_.resize(blocks_.size());
        residuals_.resize(bodies_.size()), slopes_.resize(bodies_.size());
        squares_.assign(bodies_.size(), 0), scales_.assign(bodies_.size(), 0);
    }

    /// Calls f(i) for each place at which a body is that has a flag, if the place counts on this rank.
    template <class F>
    void for_places_of(const Flags& flags, const F& f) const {
        parallel_for(
            blocks_.size(), threads_,
            [&](std::size_t i, int) {
                const auto& bodies = blocks_[i].bodies;
                if (ranks_.counts(memory_.places()[i].block) &&
                    std::any_of(bodies.begin(), bodies.end(), [&](std::size_t b) { return flags[b]; }))
                    f(i);
            },
            4);
    }
    /// Finds anew what those bodies do to matter that move, and the residuals M (u − u*) + R − dt f, their squares and
    /// scales: the largest energy of an impulse that a body has.
    /// \param of_all  whether those of all bodies are wanted, or of those that move
    void evaluate(bool of_all) {
        for_places_of(moves_, [&](std::size_t i) { find_pushes(i, pushes_[i]); });
        std::vector<ExactSum> sums(bodies_.size() * n);
        const auto is_wanted = [&](std::size_t b) { return of_all || moves_[b]; };
        for (const auto& of_block : pushes_)
            for (const PushOfBody<D>& push : of_block)
                for (int i = 0; is_wanted(push.body) && i < n; ++i)
                    sums[push.body * n + std::size_t(i)].add(push.impulse[i]);
        ranks_.merge(sums);
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            if (!is_wanted(b)) continue;
            Body& body = bodies_[b];
            auto pushed = Motions<D>::zero();
            for (int i = 0; is_touched_[b] && i < n; ++i) pushed[i] = sums[b * n + std::size_t(i)].value();
            const Motions<D> now = product<n>(body.inertia, body.velocity);
            Motions<D>& residual = residuals_[b];
            residual = now - body.free + pushed;
            for (int i = 0; i < n; ++i) residual[i] = body.drive_along(i, dt_, residual[i]);
            for (const Motions<D>& impulse : {now, body.free, pushed, body.force * dt_})
                scales_[b] = std::max(scales_[b], energy(body, impulse));
            squares_[b] = energy(body, residual);
        }
    }
    /// Finds ∂R/∂u of those bodies that need it.
    void find_slopes() {
        for_places_of(needs_slope_, [&](std::size_t i) { find_slopes(i, push_slopes_[i]); });
        std::vector<std::size_t> first(bodies_.size(), none);  // of the sums of a body
        std::size_t count = 0;
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (is_touched_[b] && needs_slope_[b]) first[b] = count, count += n * n;
        std::vector<ExactSum> sums(count);
        for (const auto& of_block : push_slopes_)
            for (const SlopeOfBody<D>& one : of_block)
                for (std::size_t i = 0; first[one.body] != none && i < n; ++i)
                    for (std::size_t j = 0; j < n; ++j) sums[first[one.body] + i * n + j].add(one.slope[i][int(j)]);
        ranks_.merge(sums);
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            for (std::size_t i = 0; first[b] != none && i < n; ++i)
                for (std::size_t j = 0; j < n; ++j) slopes_[b][i][int(j)] = sums[first[b] + i * n + j].value();
    }

    int threads_;
    const RankSums& ranks_;
    SparseGrid<S, D>& grid_;
    GapMemory<Kernel, S, D>& memory_;
    double dt_;
    std::vector<Body>& bodies_;
    std::vector<std::size_t> body_of_part_;
    std::vector<BlockByGap<D>> blocks_;
    std::vector<std::vector<PushOfBody<D>>> pushes_;        // of each place
    std::vector<std::vector<SlopeOfBody<D>>> push_slopes_;  // of each place
    // Of each body: see evaluate() and find_slopes().
    Flags is_touched_, moves_, needs_slope_;
    std::vector<Motions<D>> residuals_;
    std::vector<typename Body::Matrix> slopes_;  // ∂R/∂u
    std::vector<double> squares_, scales_;
};

/// Does the work of act_with_bodies().
template <class Kernel, class Ranks, std::floating_point S, int D, class Boundary, class View>
bool let_bodies_act(int threads, const Ranks& ranks, SparseGrid<S, D>& grid, GapContact<Boundary>& boundary, double dt,
                    const Vec<double, D>& acceleration, const MirrorsByGap<S>& mirrors, GapMemory<Kernel, S, D>& memory,
                    Reactions<D>* reactions, ParticleSets<View> sets) {
    check_step(dt);
    std::vector<MovingBody<D>> bodies;
    for_bodies(boundary, [&](auto& body, int part) {
        body.check();
        bodies.push_back(moving(body, part, acceleration, dt));
    });
    if (std::any_of(bodies.begin(), bodies.end(), [](const auto& one) { return one.layer.has_value(); })) {
        if constexpr (!std::same_as<Ranks, OneRank>)
            throw usage_error(
                "A rigid body with in_flow looks at matter cells away, which other processes have; run in one process, "
                "or without in_flow.");
    }
    const Boundary here = on_grid(boundary.boundary, grid.domain().cell_size);
    const auto exact = lift<double>(here);
    find_places(here, threads, grid, mirrors, memory, sets);
    const auto& places = memory.places();
    const RanksAs<S, D, Ranks> sums(ranks);
    RigidContact<Kernel, S, D> contact(threads, sums, grid, memory, dt, bodies);
    parallel_region(threads, [&] {
        find_nodes(exact, threads, ranks, grid, mirrors, memory, sets);
        const auto note = [&](std::size_t i, int thread) {
            contact.note(i, exact, memory.of_threads[std::size_t(thread)]);
        };
        parallel_for(places.size(), threads, note, 4);
    });
    const bool solved = contact.solve();

    Reactions<D> measured;
    begin_reactions(measured, boundary);
    const std::size_t parts = measured.parts.size();
    std::vector<Reaction<D>> of_places(places.size() * parts);
    const auto act = [&](std::size_t i, int) {
        const bool counts = sums.counts(places[i].block);
        Reaction<D>* const of_place = counts ? of_places.data() + i * parts : nullptr;
        for (std::size_t k = 0; counts && k < parts; ++k) of_place[k].about = measured.parts[k].about;
        contact.act(i, of_place);
    };
    parallel_for(places.size(), threads, act, 4);
    sum_reactions<D>(sums, of_places, measured.parts);
    std::size_t b = 0;
    for_bodies(boundary,
               [&](auto& body, int part) { pushed(body, bodies[b++], measured.parts[std::size_t(part)], dt); });
    if (reactions) {
        begin_reactions(*reactions, boundary);
        for (std::size_t k = 0; k < parts; ++k) {
            const Reaction<D>& from = measured.parts[k];
            Reaction<D>& to = reactions->parts[k];
            to.impulse = from.impulse;
            to.angular_impulse = from.angular_impulse + axial_product(from.about - to.about, from.impulse);
        }
    }
    if constexpr (has_mirrors<Boundary>) mirror_nodes(threads, sums, grid, mirrors, true, reactions);
    return solved;
}

}  // namespace detail

/// Lets a boundary with rigid bodies act on the nodes, by the gap of particles, and nodes on the bodies. Call it in
/// place of act_by_gap().
/// \param boundary      its bodies get the momenta and velocities at the end of the step
/// \param acceleration  of the bodies [m/s²]
/// \return  whether the velocities of the bodies were found. If not, momenta are conserved all the same
/// \throws parameter_error  if `dt`, a parameter of the boundary or a body is not valid
/// \see act_by_gap, about the other parameters
template <class Kernel, class Execution, std::floating_point S, int D, class Boundary, class View>
bool act_with_bodies(const Execution& execution, SparseGrid<S, D>& grid, GapContact<Boundary>& boundary, double dt,
                     const Vec<double, D>& acceleration, const MirrorsByGap<S>& mirrors,
                     GapMemory<Kernel, S, D>& memory, Reactions<D>* reactions, ParticleSets<View> sets) {
    return detail::let_bodies_act(detail::threads_of(execution), ranks_of(execution), grid, boundary, dt, acceleration,
                                  mirrors, memory, reactions, sets);
}

}  // namespace firn::inline FIRN_BUILD
