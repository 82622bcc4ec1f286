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
/// contact never adds energy. It is solved by Newton's method with the derivatives of each node's contact, body by
/// body, and steps that are halved until the residual falls. Bodies get the impulses that nodes got, so that momenta
/// are conserved however far it is solved. Sums over nodes are exact and rounded once. \see ExactSum
#pragma once

#include <firn/boundary/rigid_body.hpp>
#include <firn/loops/gap_contact.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// A body as the solver sees it: its motions, and what acts on it besides matter.
template <int D>
struct MovingBody {
    static constexpr int n = D == 2 ? 3 : 6;  ///< number of motions
    using Motion = Motions<D>;
    using Matrix = std::array<Motion, std::size_t(n)>;  ///< rows

    int part = 0;                                    ///< index among the parts of the boundary
    Vec<double, D> centre = Vec<double, D>::zero();  ///< [m]
    Matrix inertia = {};                             ///< M [kg], [kg m²]
    Matrix inverse_inertia = {};                     ///< M⁻¹
    Motion free = Motion::zero();                    ///< M u*: momenta without contact and drive [kg m/s], [kg m²/s]
    Motion velocity = Motion::zero();                ///< u [m/s], [rad/s]
    Drive<D> drive{};                                ///< what drives it
    Motion to_target = Motion::zero();               ///< where springs end, from the place of the body [m], [rad]
    Motion force = Motion::zero();                   ///< of the drive [N], [N m]
    std::array<bool, std::size_t(n)> kept = {};      ///< whether a motion has exactly the velocity of the drive

    /// Returns the velocity of the body at x [m/s].
    Vec<double, D> velocity_at(const Vec<double, D>& x) const {
        const Vec<double, D> arm = x - centre;
        if constexpr (D == 2)
            return {velocity[0] - velocity[2] * arm[1], velocity[1] + velocity[2] * arm[0]};
        else
            return Vec<double, 3>{velocity[0], velocity[1], velocity[2]} +
                   cross(Vec<double, 3>{velocity[3], velocity[4], velocity[5]}, arm);
    }
    /// Finds the drive's force along a motion at the end of a step of dt, and adds to a row of the equation.
    /// \param without  M (u − u*) + R of this motion;  \param row  the derivative of this
    /// \return         the residual of this motion
    double drive_along(int i, double dt, double without, Motion& row) {
        const auto at = std::size_t(i);
        const double most = drive.most[i], missing = drive.velocity[i] - velocity[i];
        if (drive.keeps_if_it_can(i)) {
            // The velocity is kept, unless that takes too large a force.
            const double own = inertia[at][i], needed = (without + own * missing) / dt;
            kept[at] = std::abs(needed) <= most;
            force[i] = kept[at] ? without / dt : std::copysign(most, needed);
            if (!kept[at]) return without - dt * force[i];
            row = Motion::zero();
            row[i] = own;
            return -own * missing;
        }
        const double k = drive.stiffness[i], c = drive.damping[i];
        force[i] = k * (to_target[i] - dt * velocity[i]) + c * missing;
        if (std::abs(force[i]) <= most)
            row[i] += dt * (k * dt + c);
        else
            force[i] = std::copysign(most, force[i]);
        return without - dt * force[i];
    }
};

/// Returns A x.
template <int n>
Vec<double, n> product(const std::array<Vec<double, n>, std::size_t(n)>& A, const Vec<double, n>& x) {
    Vec<double, n> y{};
    for (int i = 0; i < n; ++i) y[i] = dot(A[std::size_t(i)], x);
    return y;
}
/// Returns x with A x = b, by elimination with the largest pivot of each column.
template <int n>
Vec<double, n> solved(std::array<Vec<double, n>, std::size_t(n)> A, Vec<double, n> b) {
    for (std::size_t i = 0; i < n; ++i) {
        std::size_t pivot = i;
        for (std::size_t k = i + 1; k < n; ++k)
            if (std::abs(A[k][int(i)]) > std::abs(A[pivot][int(i)])) pivot = k;
        std::swap(A[i], A[pivot]);
        std::swap(b[int(i)], b[int(pivot)]);
        for (std::size_t k = i + 1; k < n; ++k) {
            const double factor = A[k][int(i)] / A[i][int(i)];
            A[k] = A[k] - A[i] * factor;
            b[int(k)] -= b[int(i)] * factor;
        }
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int k = i + 1; k < n; ++k) b[i] -= A[std::size_t(i)][k] * b[k];
        b[i] /= A[std::size_t(i)][i];
    }
    return b;
}

/// Calls f(body, part) for each rigid body of a boundary, with the index of its part.
template <class B, class F>
void for_bodies(B& boundary, const F& f, int first = 0) {
    using Boundary = std::remove_const_t<B>;
    if constexpr (!has_rigid_bodies<Boundary>) {
        return;
    } else if constexpr (requires { Boundary::is_rigid_body; }) {
        f(boundary, first);
    } else if constexpr (requires { boundary.parts; }) {
        std::apply([&](auto&... part) { ((for_bodies(part, f, first), first += firn::part_count(part)), ...); },
                   boundary.parts);
    } else if constexpr (requires { boundary.all; }) {
        for (auto& one : boundary.all) for_bodies(one, f, first), first += firn::part_count(one);
    } else {
        for_bodies(boundary.boundary, f, first);
    }
}

/// Returns a body as the solver sees it.
/// \param acceleration  [m/s²];  \param dt  [s]
template <class C, int D = C::D>
MovingBody<D> moving(const RigidBody<C>& body, int part, const Vec<double, D>& acceleration, double dt) {
    MovingBody<D> one{.part = part, .centre = body.collider.position, .drive = body.drive};
    constexpr int n = MovingBody<D>::n;
    for (int a = 0; a < D; ++a) {
        one.inertia[std::size_t(a)][a] = body.mass;
        one.inverse_inertia[std::size_t(a)][a] = 1 / body.mass;
        one.free[a] = body.momentum[a] + dt * (body.mass * acceleration[a] + body.force[a]);
        one.to_target[a] = body.drive.position[a] - body.collider.position[a];
    }
    const auto about = body.inertia_in_space(body.collider.rotation);
    const auto turn = turn_between(body.collider.rotation, body.drive.rotation);
    if constexpr (D == 2) {
        one.inertia[2][2] = about, one.inverse_inertia[2][2] = 1 / about;
        one.free[2] = body.angular_momentum + dt * body.torque;
        one.to_target[2] = turn;
    } else {
        const Mat<double, 3> inverse = inverse_transposed(about);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                one.inertia[std::size_t(3 + i)][3 + j] = about(i, j);
                one.inverse_inertia[std::size_t(3 + i)][3 + j] = inverse(i, j);
            }
            one.free[3 + i] = body.angular_momentum[i] + dt * body.torque[i];
            one.to_target[3 + i] = turn[i];
        }
    }
    one.velocity = product<n>(one.inverse_inertia, one.free);
    for (int i = 0; i < n; ++i)
        if (one.drive.keeps(i)) one.velocity[i] = one.drive.velocity[i];
    return one;
}

/// A surface near a node, and the gap between it and matter [m].
template <int D>
struct SurfaceByGap {
    ActingSurface<double, D> is;
    double gap;
    int part;
};
/// A node that surfaces may act on.
template <int D>
struct NodeByGap {
    Vec<double, D> x, v;            ///< position [m] and velocity before contact [m/s]
    double mass;                    ///< [kg]
    int node;                       ///< index in its block
    std::uint32_t first, surfaces;  ///< its surfaces in the list of its block
};
/// What surfaces may do in one block. It does not depend on the velocities of bodies.
template <int D>
struct BlockByGap {
    std::vector<NodeByGap<D>> nodes{};
    std::vector<SurfaceByGap<D>> surfaces{};
};

/// Notes the surfaces that may act on a node, with their gaps: a function like ActByGap.
template <int D, class Nearest>
struct NoteGaps {
    const ActByGap<D, Nearest>& act;
    std::vector<SurfaceByGap<D>>& surfaces;

    template <class... Look>
    void add(NodeAtSurfaces<double, D>&, int part, const Vec<double, D>&, ActingSurface<double, D> surface,
             const Look&... look) const {
        if (surface.contact == Contact::none || !surface.acts) return;
        const double gap = act.gap_to(surface.distance, surface.normal, look...);
        if (gap < act.none) surfaces.push_back({surface, gap, part});
    }
};

/// What a body does to matter: R(u), and the derivative of R by u.
template <int D>
struct PushOfBody {
    static constexpr int n = MovingBody<D>::n;
    std::size_t body;
    Motions<D> impulse = Motions<D>::zero();    ///< R [N s], [N m s]
    typename MovingBody<D>::Matrix slope = {};  ///< ∂R/∂u
    /// Adds the impulse on a node at `arm` from the centre, and its derivative by the body's velocity there.
    void add(const Vec<double, D>& arm, const Vec<double, D>& on_matter, const Mat<double, D>& by_velocity) {
        // The velocity at `arm` is J u, and R = Jᵀ impulse.
        Vec<double, D> J[std::size_t(n)];
        for (int a = 0; a < D; ++a) J[a] = Vec<double, D>::zero(), J[a][a] = 1;
        if constexpr (D == 2) {
            J[2] = {-arm[1], arm[0]};
        } else {
            for (int a = 0; a < 3; ++a) J[3 + a] = cross(J[a], arm);
        }
        for (int i = 0; i < n; ++i) {
            impulse[i] += dot(J[i], on_matter);
            for (int j = 0; j < n; ++j) slope[std::size_t(i)][j] += dot(J[i], by_velocity * J[j]);
        }
    }
};

/// Returns the derivative, by the velocity of a surface, of the change of a node's velocity that the surface makes.
/// \param change  what it changes the node's velocity by [m/s];  \param v  velocity of the node before [m/s]
/// \param open    speed at which matter may approach the surface [m/s]
template <int D>
Mat<double, D> slope_of_contact(const ActingSurface<double, D>& surface, bool held, const Vec<double, D>& v,
                                const Vec<double, D>& change, double open) {
    const auto I = Mat<double, D>::identity();
    if (!(dot(change, change) > 0)) return Mat<double, D>::zero();
    if (held && surface.contact == Contact::stick) return I;
    const Vec<double, D>& normal = surface.normal;
    const Vec<double, D> relative = v - surface.velocity;
    const double into = dot(relative, normal) + open;
    const Vec<double, D> along = relative - normal * dot(relative, normal),
                         rubbed = change - normal * dot(change, normal);
    const double speed = norm(along);
    const Mat<double, D> nn = outer(normal, normal);
    if (!(norm(rubbed) > 1e-12 * speed)) return nn;
    if (norm(rubbed) >= speed * (1 - 1e-9)) return I;  // sticks by friction
    const Vec<double, D> t = along * (1 / speed);
    const double mu = surface.friction;
    return nn - outer(t, normal) * mu + (I - nn - outer(t, t)) * (-mu * std::min(into, 0.0) / speed);
}

/// Does the work of act_with_bodies().
template <class Kernel, std::floating_point S, int D>
class RigidContact {
    using Body = MovingBody<D>;
    static constexpr int n = Body::n;
    static constexpr std::size_t numbers = std::size_t(n + n * n);

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
            NodeByGap<D> one{node_position(grid_, place.block, node), {}, double(values[node_mass]), node,
                             std::uint32_t(block.surfaces.size()),    0};
            for (int a = 0; a < D; ++a) one.v[a] = double(values[a]);
            const auto nearest = [&](const Vec<double, D>& normal) {
                return h * Separator<Kernel, D>::depth(at_node, normal);
            };
            const ActByGap<D, decltype(nearest)> act{h, dt_, nearest};
            velocity_by_gap<Boundary, D>(boundary, one.x, one.v, NoteGaps<D, decltype(nearest)>{act, block.surfaces},
                                         AnySurface{});
            one.surfaces = std::uint32_t(block.surfaces.size()) - one.first;
            if (one.surfaces > 0) block.nodes.push_back(one);
        }
    }

    /// Finds the velocities of the bodies. \return whether the residual became small
    bool solve() {
        double scale = 0;
        double residual = evaluate(scale);
        std::vector<Motions<D>> start(bodies_.size()), step(bodies_.size());
        for (int iteration = 0; iteration < most_iterations && !is_small(residual, scale); ++iteration) {
            for (std::size_t b = 0; b < bodies_.size(); ++b) {
                start[b] = bodies_[b].velocity;
                step[b] = solved<n>(matrices_[b], residuals_[b]);
            }
            double part = 1, best = residual;
            for (int halving = 0; halving < most_halvings; ++halving, part /= 2) {
                for (std::size_t b = 0; b < bodies_.size(); ++b) bodies_[b].velocity = start[b] - step[b] * part;
                best = evaluate(scale);
                if (best < residual || is_small(best, scale)) break;
            }
            if (!(best < residual) && !is_small(best, scale)) {  // rounding, or friction that has no better velocity
                for (std::size_t b = 0; b < bodies_.size(); ++b) bodies_[b].velocity = start[b];
                evaluate(scale);
                break;
            }
            residual = best;
        }
        return residual <= 1e-12 * scale;  // of squares
    }

    /// Lets the surfaces act on the nodes of place i. \param reactions  one for each part, or nullptr
    void act(std::size_t i, Reaction<D>* reactions) {
        const auto& place = memory_.places()[i];
        for (const NodeByGap<D>& one : blocks_[i].nodes) {
            const Vec<double, D> after =
                velocity_of(blocks_[i], one, [&](int part, const Vec<double, D>& before, const Vec<double, D>& then) {
                    if (reactions) add_impulse(reactions[part], one.x, one.mass, then - before);
                });
            S* const values = grid_.nodes(place.block) + one.node * node_width;
            for (int a = 0; a < D; ++a) values[a] = S(after[a]);
        }
    }

private:
    static constexpr std::size_t none = std::size_t(-1);
    static constexpr int most_iterations = 60, most_halvings = 12;

    /// \param square  of the residual, in J;  \param scale  in J
    static bool is_small(double square, double scale) { return !(square > 1e-28 * scale); }
    /// Returns ½ pᵀ M⁻¹ p [J].
    static double energy(const Body& body, const Motions<D>& p) {
        return 0.5 * dot(p, product<n>(body.inverse_inertia, p));
    }
    std::size_t body_of(int part) const {
        return std::size_t(part) < body_of_part_.size() ? body_of_part_[std::size_t(part)] : none;
    }

    /// Returns the velocity of a node after its surfaces have acted. \see NodeAtSurfaces::velocity
    template <class Seen>
    Vec<double, D> velocity_of(const BlockByGap<D>& block, const NodeByGap<D>& one, const Seen& seen) const {
        static constexpr int no_matter = 0;
        const ActByGap<D, int> act{grid_.domain().cell_size, dt_, no_matter};
        NodeAtSurfaces<double, D> node(one.v);
        for (std::uint32_t k = 0; k < one.surfaces; ++k) {
            const SurfaceByGap<D>& surface = block.surfaces[one.first + k];
            act.add_at(node, surface.part, one.v, moved(surface, one.x), surface.gap);
        }
        return node.velocity(seen);
    }
    /// Returns a surface with the present velocity of its body.
    ActingSurface<double, D> moved(const SurfaceByGap<D>& surface, const Vec<double, D>& x) const {
        ActingSurface<double, D> now = surface.is;
        if (const std::size_t b = body_of(surface.part); b != none) now.velocity = bodies_[b].velocity_at(x);
        return now;
    }

    /// Finds what bodies do to the matter of place i.
    void find_pushes(std::size_t i, std::vector<PushOfBody<D>>& pushes) const {
        const BlockByGap<D>& block = blocks_[i];
        const double h = grid_.domain().cell_size;
        for (const NodeByGap<D>& one : block.nodes) {
            std::uint32_t k = 0;
            velocity_of(block, one, [&](int part, const Vec<double, D>& before, const Vec<double, D>& after) {
                const SurfaceByGap<D>& surface = block.surfaces[one.first + k++];
                const std::size_t b = body_of(part);
                const Vec<double, D> change = after - before;
                if (b == none || !(dot(change, change) > 0)) return;
                auto mine = std::find_if(pushes.begin(), pushes.end(), [&](const auto& p) { return p.body == b; });
                if (mine == pushes.end()) mine = pushes.insert(mine, PushOfBody<D>{.body = b});
                const bool held = holds(surface.is.contact) && surface.gap <= boundary_reach * h;
                const Mat<double, D> slope = slope_of_contact(moved(surface, one.x), held, one.v, change,
                                                              held ? 0 : closing_speed(surface.gap, dt_));
                mine->add(one.x - bodies_[b].centre, change * one.mass, slope * one.mass);
            });
        }
    }

    /// Finds the residuals M (u − u*) + R − dt f of all bodies, and their derivatives.
    /// \param scale  becomes at least the energy of each body's impulses
    /// \return  the square of the residuals, as an energy [J]
    double evaluate(double& scale) {
        std::vector<std::vector<PushOfBody<D>>> pushes(blocks_.size());
        parallel_for(
            blocks_.size(), threads_,
            [&](std::size_t i, int) {
                if (ranks_.counts(memory_.places()[i].block)) find_pushes(i, pushes[i]);
            },
            4);
        std::vector<ExactSum> sums(bodies_.size() * numbers);
        for (const auto& of_block : pushes)
            for (const PushOfBody<D>& push : of_block) {
                ExactSum* sum = sums.data() + push.body * numbers;
                for (int i = 0; i < n; ++i) (sum++)->add(push.impulse[i]);
                for (const auto& row : push.slope)
                    for (int j = 0; j < n; ++j) (sum++)->add(row[j]);
            }
        ranks_.merge(sums);
        residuals_.resize(bodies_.size());
        matrices_.resize(bodies_.size());
        double square = 0;
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            Body& body = bodies_[b];
            const ExactSum* sum = sums.data() + b * numbers;
            Motions<D> pushed{};
            for (int i = 0; i < n; ++i) pushed[i] = (sum++)->value();
            const Motions<D> now = product<n>(body.inertia, body.velocity);
            Motions<D>& residual = residuals_[b];
            residual = now - body.free + pushed;
            matrices_[b] = body.inertia;
            for (std::size_t i = 0; i < n; ++i)
                for (int j = 0; j < n; ++j) matrices_[b][i][j] += (sum++)->value();
            for (int i = 0; i < n; ++i)
                residual[i] = body.drive_along(i, dt_, residual[i], matrices_[b][std::size_t(i)]);
            for (const Motions<D>& impulse : {now, body.free, pushed, body.force * dt_})
                scale = std::max(scale, energy(body, impulse));
            square += energy(body, residual);
        }
        return square;
    }

    int threads_;
    const RankSums& ranks_;
    SparseGrid<S, D>& grid_;
    GapMemory<Kernel, S, D>& memory_;
    double dt_;
    std::vector<Body>& bodies_;
    std::vector<std::size_t> body_of_part_;
    std::vector<BlockByGap<D>> blocks_;
    std::vector<Motions<D>> residuals_;
    std::vector<typename Body::Matrix> matrices_;
};

/// Gives a body the momenta that it has after contact.
/// \param reaction  the impulse of the body on matter, about its centre;  \param dt  [s]
template <class C, int D = C::D>
void pushed(RigidBody<C>& body, const MovingBody<D>& one, const Reaction<D>& reaction, double dt) {
    constexpr int n = MovingBody<D>::n;
    Motions<D> on_matter{}, momenta{};
    for (int a = 0; a < D; ++a) on_matter[a] = reaction.impulse[a];
    if constexpr (D == 2)
        on_matter[2] = reaction.angular_impulse;
    else
        for (int a = 0; a < 3; ++a) on_matter[3 + a] = reaction.angular_impulse[a];
    const Motions<D> kept = product<n>(one.inertia, one.velocity);
    for (int i = 0; i < n; ++i) {
        momenta[i] = one.free[i] - on_matter[i];
        body.driven[i] = one.kept[std::size_t(i)] ? (kept[i] - momenta[i]) / dt : one.force[i];
        momenta[i] = one.kept[std::size_t(i)] ? kept[i] : momenta[i] + dt * body.driven[i];
    }
    for (int a = 0; a < D; ++a) body.momentum[a] = momenta[a];
    if constexpr (D == 2)
        body.angular_momentum = momenta[2];
    else
        for (int a = 0; a < 3; ++a) body.angular_momentum[a] = momenta[3 + a];
    body.place_velocities();
    for (int a = 0; a < D; ++a)
        if (one.kept[std::size_t(a)]) body.collider.linear_velocity[a] = one.velocity[a];
    for (int i = D; i < n; ++i)
        if (one.kept[std::size_t(i)]) {
            if constexpr (D == 2)
                body.collider.angular_velocity = one.velocity[i];
            else
                body.collider.angular_velocity[i - 3] = one.velocity[i];
        }
}

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
