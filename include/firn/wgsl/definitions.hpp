/// \file Records the C++ functions that define a step (those of the kernel, the transfer, the material, …), and adds
/// them to a WGSL module.
#pragma once

#include <firn/boundary/room.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/force/none.hpp>
#include <firn/material/concept.hpp>
#include <firn/stage/grid_update.hpp>
#include <firn/stage/mirror_planes.hpp>
#include <firn/stage/push.hpp>
#include <firn/stage/series.hpp>
#include <firn/stage/shifting.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/stage/volume.hpp>
#include <firn/stage/volume_filter.hpp>
#include <firn/wgsl/layout.hpp>
#include <firn/wgsl/module.hpp>
#include <firn/wgsl/stage_shapes.hpp>

#include <limits>

namespace firn::inline FIRN_BUILD::wgsl {

namespace detail {

/// Returns the scalar of type `recorded` that stands for the uniform with the given name. (A uniform is a value that
/// the host sets.)
inline recorded uniform(const std::string& name) { return recorded::of(Recording::current().input("params." + name)); }

/// Returns the recorded scalar or vector that stands for the uniform with the given name.
template <class T>
T uniform_of(const std::string& name) {
    T value{};
    shape<T>::visit(value, "params." + name,
                    [](recorded& x, const std::string& text) { x = recorded::of(Recording::current().input(text)); });
    return value;
}

/// Returns a copy of the policy, with scalar type `recorded`. In the copy, a parameter NAME of the policy is the
/// uniform PREFIX_NAME, where PREFIX is `prefix`. The other members are constants.
template <class Policy>
auto with_uniforms(const Policy& policy, const std::string& prefix) {
    auto lifted = lift<recorded>(policy);
    for_parameters(
        lifted,
        [](const std::string& name, const char*, auto& value) {
            using Value = std::remove_cvref_t<decltype(value)>;
            static_assert(!std::is_arithmetic_v<Value>,
                          "firn: a policy whose parameters are to be uniforms of a WGSL program is a template over its "
                          "scalar: template <firn::scalar S> struct MyWall { S height; … }.");
            if constexpr (!std::is_arithmetic_v<Value>) value = uniform_of<Value>(name);
        },
        prefix + "_");
    return lifted;
}

/// Returns a transfer with scalar type `recorded`. Its parameters are uniforms, unless it refines velocities: the
/// number of its terms is that of entry points.
template <class Transfer>
auto recorded_transfer(const Transfer& transfer) {
    if constexpr (refines_velocities<Transfer>)
        return lift<recorded>(transfer);
    else
        return with_uniforms(transfer, "transfer");
}

/// Adds the functions that sum over the nodes along one axis: NAMEA for axis A, and one for each later axis.
/// \tparam V  what a node has: in G2P, its velocity
template <class Kernel, int D, int A, bool Moments, bool Gradients, class V = Vec<recorded, D>>
void add_axis_sums(Module& module, const char* of = "sum_axis") {
    if constexpr (A < D) {
        constexpr std::size_t K = std::size_t(Kernel::support);
        using Parts = std::array<PartialSums<V, A, Moments, Gradients>, K>;
        using Weights = std::array<recorded, K>;
        const std::string name = of + std::to_string(A), comment = "firn/stage/g2p.hpp: sums along an axis";
        if constexpr (Gradients)
            module.function<Parts, Weights, Weights>(name, comment, {"parts", "w", "g"},
                                                     [](const Parts& parts, const Weights& w, const Weights& g) {
                                                         return sum_axis<centre_node<Kernel>>(parts, w, g);
                                                     });
        else
            module.function<Parts, Weights>(name, comment, {"parts", "w"}, [](const Parts& parts, const Weights& w) {
                return sum_axis<centre_node<Kernel>>(parts, w, w);
            });
        add_axis_sums<Kernel, D, A + 1, Moments, Gradients, V>(module, of);
    }
}

/// Returns the scalars of type `recorded` that stand for the time step dt [s] that the program has chosen, and for dt/h
/// [s/m]; see text::time_step.
inline recorded time_step() { return recorded::of(Recording::current().input("chosen.time_step")); }
inline recorded place_per_velocity() { return recorded::of(Recording::current().input("chosen.place_per_velocity")); }
inline recorded cell_size() { return uniform("cell_size"); }

}  // namespace detail

/// Adds the functions of the kernel to the module: base_node_of (coordinates of the first node that a particle
/// touches), kernel_weights and, if `with_gradients` is true, kernel_gradients, the derivatives of the weights
/// [1/cell].
template <class Kernel, int D>
void add_kernel(Module& module, bool with_gradients) {
    using R = recorded;
    using V = Vec<R, D>;
    const std::string of_kernel = std::string(Kernel::name) + ", ";
    module.function<V>("base_node_of", of_kernel + "firn/data/block_partition.hpp", {"place"}, [](const V& place) {
        V base{};
        for (int a = 0; a < D; ++a) base[a] = base_node<Kernel>(place[a]);
        return base;
    });
    const char* of_weights = "firn/kernel/concept.hpp: weights of the nodes from the base node on";
    module.function<R>("kernel_weights", of_kernel + of_weights, {"f"}, [](const R& f) { return Kernel::weights(f); });
    if (with_gradients)
        module.function<R>("kernel_gradients", of_kernel + "and their derivatives, per cell", {"f"},
                           [](const R& f) { return Kernel::gradients(f); });
}

/// Adds the functions of P2G to the module, and the functions that choose the scale (quanta per unit) of the integer
/// sums at the nodes. \see stage/p2g.hpp, stage/fixed_point.hpp
template <class Kernel, class Transfer, class Force, int D>
void add_p2g(Module& module) {
    using R = recorded;
    using V = Vec<R, D>;
    using OfNode = Vec<R, node_width>;  // a node's momentum (in 2D followed by a 0) and mass
    constexpr bool gradients = Force::weight_gradients;
    const std::string of_transfer = std::string(Transfer::name) + ", ", of_force = std::string(Force::name) + ", ";
    module.function<P2GParticle<R, D>, V>(
        "record_of", of_transfer + of_force + "firn/stage/p2g.hpp: what a particle gives", {"particle", "fraction"},
        [&](const P2GParticle<R, D>& particle, const V& fraction) {
            return make_record<Kernel, Transfer, Force>(particle, from_centre<Kernel>(fraction), detail::cell_size(),
                                                        detail::time_step());
        });
    module.function<P2GRecord<R, D>, FixedPointScale<R>>(
        "in_quanta", "firn/stage/fixed_point.hpp", {"record", "scale"},
        [](const P2GRecord<R, D>& record, const FixedPointScale<R>& scale) { return in_quanta(record, scale); });
    const auto close = [](const P2GRecord<R, D>& record, const R& o, const R& w, const R& g) {
        const auto node = [](const Vec<R, D>& v, const R& mass) {
            OfNode r = OfNode::zero();
            for (int i = 0; i < D; ++i) r[i] = v[i];
            r[node_mass] = mass;
            return r;
        };
        OpenRecord<OfNode, D, gradients> open;
        open.value = node(record.momentum, record.mass);
        for (int a = 0; a < D; ++a) {
            open.column[std::size_t(a)] = node(record.affine.column(a), R(0));
            if constexpr (gradients) open.gradient[std::size_t(a)] = node(record.gradient.column(a), R(0));
        }
        return open.contract(o, w, g);
    };
    const std::string closes = "firn/stage/p2g.hpp: closes the last axis at offset o";
    const std::string weighs = "firn/stage/p2g.hpp: what a node at offset o along the other axes receives";
    using Line = OpenRecord<OfNode, D - 1, gradients>;
    using Offset = std::array<R, std::size_t(D - 1)>;
    const auto value_at = [](Line line, const Offset& o, const R& weight, const Offset& g) {
        for (int a = D - 2; a >= 0; --a) line = line.moved(a, o[std::size_t(a)]);
        if constexpr (gradients)
            return line.weighted(weight, g);
        else
            return line.weighted(weight, {});
    };
    if constexpr (gradients) {
        module.function<P2GRecord<R, D>, R, R, R>("close_last_axis", closes, {"record", "o", "w", "g"}, close);
        module.function<Line, Offset, R, Offset>("value_at", weighs, {"line", "o", "weight", "g"}, value_at);
    } else {
        module.function<P2GRecord<R, D>, R, R>(
            "close_last_axis", closes, {"record", "o", "w"},
            [&](const P2GRecord<R, D>& record, const R& o, const R& w) { return close(record, o, w, w); });
        module.function<Line, Offset, R>(
            "value_at", weighs, {"line", "o", "weight"},
            [&](const Line& line, const Offset& o, const R& weight) { return value_at(line, o, weight, o); });
    }

    // Functions that choose the scale (quanta per unit) of the integer sums at the nodes.
    module.function<P2GRecord<R, D>>(
        "load_of", "firn/stage/fixed_point.hpp: what the fixed-point scale has to know of a particle", {"record"},
        [](const P2GRecord<R, D>& record) { return load_of<Kernel, Force>(record); });
    module.function<FixedPointLoad<R>>(
        "bound_of", "firn/stage/fixed_point.hpp: what a node may receive", {"load"},
        [](const FixedPointLoad<R>& load) { return fixed_point_bound<Kernel, D>(load); });
    module.function<FixedPointBound<R>>(
        "scale_of", "firn/stage/fixed_point.hpp", {"bound"}, [](const FixedPointBound<R>& bound) {
            return largest_scale(bound, double(std::numeric_limits<std::int32_t>::max()));
        });
}

/// Adds the functions of the time step to the module: stable_step and accelerated_step, the largest time steps [s] for
/// a signal speed and for an acceleration; step_within, the step in the time left; and place_per_velocity_of, dt / h
/// [s/m]. \see stage/time_step.hpp
template <class Kernel>
void add_time_step(Module& module) {
    using R = recorded;
    module.function<R>("stable_step", "firn/stage/time_step.hpp: the largest stable time step", {"signal_speed"},
                       [](const R& speed) { return stable_time_step<Kernel>(detail::cell_size(), speed); });
    module.function<R>("accelerated_step", "firn/stage/time_step.hpp: the largest time step for an acceleration",
                       {"acceleration"}, [](const R& a) { return acceleration_time_step(detail::cell_size(), a); });
    module.function<TimeLeft<R>, R>("step_within", "firn/stage/time_step.hpp: the step in the time left",
                                    {"left", "bound"},
                                    [](const TimeLeft<R>& left, const R& bound) { return step_within(left, bound); });
    module.function<R>("place_per_velocity_of", "firn/stage/time_step.hpp: cells per velocity", {"dt"},
                       [](const R& dt) { return cells_per_velocity(dt, detail::cell_size()); });
}

/// Adds the function time_after, which returns the time after a step. \see stage/time_step.hpp
inline void add_time(Module& module) {
    using R = recorded;
    module.function<TimeReached<R>, R>(
        "time_after", "firn/stage/time_step.hpp: the time after a step", {"before", "dt"},
        [](const TimeReached<R>& before, const R& dt) { return time_after(before, dt); });
}

/// Adds the function acceleration_of, which returns the size of the field's acceleration that limits the time step.
/// \see stage/grid_update.hpp
template <int D, class Field>
void add_acceleration(Module& module, const Field& field) {
    using V = Vec<recorded, D>;
    module.function<V, V>("acceleration_of", std::string(Field::name) + ": what limits the time step [m/s^2]",
                          {"position", "velocity"}, [&](const V& position, const V& velocity) {
                              return sqrt(squared_acceleration(detail::with_uniforms(field, "field"), position,
                                                               velocity, detail::time_step()));
                          });
}

/// Adds the function of the grid update to the module: velocity_of_node, which returns a node's new velocity. \see
/// stage/grid_update.hpp
template <int D, class Boundary, class Field>
void add_grid_update(Module& module, const Boundary& boundary, const Field& field) {
    using R = recorded;
    using V = Vec<R, D>;
    module.function<V, R, V>(
        "velocity_of_node", std::string(Boundary::name) + ", " + Field::name + ", firn/stage/grid_update.hpp",
        {"momentum", "mass", "position"}, [&](const V& momentum, const R& mass, const V& position) {
            return node_velocity(momentum, mass, position, detail::with_uniforms(field, "field"), detail::time_step(),
                                 on_grid(detail::with_uniforms(boundary, "boundary"), detail::cell_size()));
        });
}

/// A recorded boundary that also tells by how much each of its parts changes a velocity.
template <int D, class Boundary>
struct WatchedParts {
    const Boundary& boundary;   ///< the boundary
    Vec<recorded, D>* changes;  ///< receives the change of each part [m/s]

    /// Returns the velocity of a node after the boundary has acted on it, as the boundary does.
    Vec<recorded, D> velocity(const Vec<recorded, D>& x, const Vec<recorded, D>& v, const recorded& mass,
                              const recorded& dt) const {
        const auto seen = [&](int k, const Vec<recorded, D>& before, const Vec<recorded, D>& after) {
            changes[k] += after - before;
        };
        return velocity_among(boundary, x, v, NoOthers{}, seen, NodeInertia<recorded>{mass, dt});
    }
};

/// Adds, in place of velocity_of_node(), the function velocity_and_changes: a node's new velocity, and by how much each
/// part of the boundary has changed it [m/s].
template <int D, class Boundary, class Field>
void add_reactions(Module& module, const Boundary& boundary, const Field& field) {
    using R = recorded;
    using V = Vec<R, D>;
    module.function<V, R, V>(
        "velocity_and_changes", std::string(Boundary::name) + ", " + Field::name + ", firn/stage/grid_update.hpp",
        {"momentum", "mass", "position"}, [&](const V& momentum, const R& mass, const V& position) {
            std::array<V, 1 + most_reacting_parts> all;
            all.fill(V::zero());
            const auto here = on_grid(detail::with_uniforms(boundary, "boundary"), detail::cell_size());
            const WatchedParts<D, std::remove_cvref_t<decltype(here)>> watched{here, &all[1]};
            all[0] = node_velocity(momentum, mass, position, detail::with_uniforms(field, "field"), detail::time_step(),
                                   watched);
            return all;
        });
}

/// Adds, for the k-th of a boundary's mirrored walls (from 0), the functions position_of_wall_k, which returns the
/// position [m] of the wall along its axis, and mirrored_k, which returns the nodes of a column after the wall has
/// acted on them. \see stage/mirror.hpp
/// \param walls          the mirrored walls, in the order in which the boundary reports them
/// \param before_forces  whether there is also mirrored_before_k, for velocities before forces act: walls are without
///                       friction then
template <class Kernel, int D, class Boundary>
void add_mirrors(Module& module, const Boundary& boundary, const std::vector<MirrorPlane>& walls, bool before_forces) {
    using R = recorded;
    const SurfaceWeights<double> weights = surface_weights<Kernel, double>();
    for (std::size_t k = 0; k < walls.size(); ++k) {
        const MirrorPlane& wall = walls[k];
        const std::string number = std::to_string(k), of_boundary = std::string(Boundary::name) + ", ";
        module.function<>(
            "position_of_wall_" + number,
            of_boundary + "the position of a mirrored wall along axis " + std::to_string(wall.axis) + " [m]", {}, [&] {
                R found;
                std::size_t i = 0;
                detail::with_uniforms(boundary, "boundary").mirrors([&](int, const auto& position, auto&&...) {
                    if (i++ == k) found = R(position);
                });
                return found;
            });
        const auto add = [&](const std::string& name, double friction) {
            module.function<NodeColumn<R, D>>(
                name + number, of_boundary + "firn/stage/mirror.hpp: " + name_of(wall.contact), {"column"},
                [&](const NodeColumn<R, D>& column) {
                    return mirrored(column, wall.axis, wall.inward, wall.contact, R(friction),
                                    SurfaceWeights<R>{R(weights.on), R(weights.beside)});
                });
        };
        add("mirrored_", wall.friction);
        if (before_forces) add("mirrored_before_", 0);
    }
}

/// Adds the functions of G2P to the module: sum_axis0, … (sums over the nodes along one axis), take_from_grid (a
/// particle's new velocity and velocity gradient) and moved_by (a particle's new position). \see stage/g2p.hpp
template <class Kernel, class Transfer, class Force, int D>
void add_g2p(Module& module, const Transfer& transfer, bool periodic) {
    using R = recorded;
    using V = Vec<R, D>;
    constexpr bool sum_moments = g2p_needs_moment<Kernel, Transfer, Force>;
    constexpr bool sum_gradients = g2p_needs_gradient<Kernel, Transfer, Force>;
    const std::string of_transfer = std::string(Transfer::name) + ", ", of_force = std::string(Force::name) + ", ";
    detail::add_axis_sums<Kernel, D, 0, sum_moments, sum_gradients>(module);
    using Sums = PartialSums<V, D, sum_moments, sum_gradients>;
    module.function<Sums, V>("take_from_grid", of_transfer + of_force + "firn/stage/g2p.hpp", {"sums", "fraction"},
                             [&](const Sums& sums, const V& fraction) {
                                 G2PSums<R, D> all{};
                                 all.velocity = sums.value;
                                 for (int a = 0; a < D; ++a)
                                     for (int i = 0; i < D; ++i) {
                                         if constexpr (sum_moments) all.moment(i, a) = sums.moment[std::size_t(a)][i];
                                         if constexpr (sum_gradients)
                                             all.gradient(i, a) = sums.gradient[std::size_t(a)][i];
                                     }
                                 return take_from_grid<Kernel, Transfer, Force>(all, from_centre<Kernel>(fraction),
                                                                                detail::cell_size(),
                                                                                detail::recorded_transfer(transfer));
                             });
    module.function<V, V, V>("moved_by", "firn/stage/g2p.hpp: where a particle goes, which counts from `corner`",
                             {"velocity", "place", "corner"}, [&](const V& velocity, const V& place, const V& corner) {
                                 const V lowest = periodic ? detail::uniform_of<V>("lowest") : V::zero();
                                 const V highest = detail::uniform_of<V>(periodic ? "highest" : "cells");
                                 return moved_by(velocity, detail::place_per_velocity(), place, lowest - corner,
                                                 highest - corner);
                             });
}

/// Adds the function pushed_by, which returns what a load does. \see stage/push.hpp
template <int D>
void add_push(Module& module) {
    using R = recorded;
    module.function<Vec<R, D>, R>(
        "pushed_by", "firn/stage/push.hpp", {"force", "mass"},
        [](const Vec<R, D>& force, const R& mass) { return firn::pushed_by(force, detail::time_step(), mass); });
}

/// Adds the functions for velocities before forces act: record_before_forces (what a particle gives to the nodes),
/// velocity_before_forces (of a node, after that) and sum_velocities (a sum over the nodes along an axis).
template <class Kernel, class Transfer, int D>
void add_before_forces(Module& module) {
    using R = recorded;
    using V = Vec<R, D>;
    const std::string of_transfer = std::string(Transfer::name) + ", ";
    module.function<P2GParticle<R, D>, V>(
        "record_before_forces", of_transfer + "firn/stage/p2g.hpp: what a particle gives before forces act",
        {"particle", "fraction"}, [](const P2GParticle<R, D>& particle, const V& fraction) {
            return make_record<Kernel, Transfer, NoForce>(particle, from_centre<Kernel>(fraction), detail::cell_size(),
                                                          R(0));
        });
    module.function<V, R>("velocity_before_forces", "firn/stage/grid_update.hpp, without forces and boundary",
                          {"momentum", "mass"}, [](const V& momentum, const R& mass) {
                              return node_velocity(momentum, mass, V::zero(), V::zero(), R(0), NoBoundary{});
                          });
    constexpr std::size_t K = std::size_t(Kernel::support);
    module.function<std::array<V, K>, std::array<R, K>>("sum_velocities", "firn/stage/g2p.hpp: the sum along an axis",
                                                        {"parts", "w"},
                                                        [](const std::array<V, K>& parts, const std::array<R, K>& w) {
                                                            std::array<PartialSums<V, 0, false, false>, K> sums;
                                                            for (std::size_t k = 0; k < K; ++k)
                                                                sums[k].value = parts[k];
                                                            return sum_axis<centre_node<Kernel>>(sums, w, w).value;
                                                        });
}

/// Adds the function of a transfer that refines velocities, by a series: next_of_series, the next partial sum at a
/// node; and momentum_of_series, a node's momentum after the last one. \see refines_velocities
/// \param is_mirrored  whether mirrored walls act on the terms
template <class Transfer, int D>
void add_series(Module& module, bool is_mirrored) {
    using R = recorded;
    using V = Vec<R, D>;
    const std::string of_transfer = std::string(Transfer::name) + ", ";
    const auto next = [](const V& first, const V& last, const V& back) { return Transfer::next(first, last, back); };
    module.function<V, V, V>("next_of_series", of_transfer + "the next partial sum at a node",
                             {"first", "last", "back"}, next);
    const std::string comment = of_transfer + "firn/stage/series.hpp: a node's momentum after the last term";
    if (is_mirrored)
        module.function<V, V, V, V, R>(
            "momentum_of_series", comment, {"first", "last", "back", "before", "mass"},
            [&](const V& first, const V& last, const V& back, const V& before, const R& mass) {
                return momentum_of_series(next(first, last, back), before, first, mass);
            });
    else
        module.function<V, V, V, R>("momentum_of_series", comment, {"first", "last", "back", "mass"},
                                    [&](const V& first, const V& last, const V& back, const R& mass) {
                                        return momentum_of_series(next(first, last, back), mass);
                                    });
}

/// Adds the function of a transfer that blends velocities: blended, the velocities of a particle after the step. \see
/// blends_velocities
template <class Transfer, int D>
void add_blend(Module& module, const Transfer& transfer) {
    using R = recorded;
    using V = Vec<R, D>;
    const std::string of_transfer = std::string(Transfer::name) + ", ";
    module.function<G2PResult<R, D>, V, V>(
        "blended", of_transfer + "firn/transfer/concept.hpp: the velocities after a step", {"taken", "before", "own"},
        [&](G2PResult<R, D> taken, const V& before, const V& own) {
            for (int i = 0; i < D; ++i) taken.velocity_gradient(i, i) = settled(taken.velocity_gradient(i, i));
            return detail::with_uniforms(transfer, "transfer")
                .blended(taken.velocity, before, own, taken.velocity_gradient);
        });
}

/// Adds the functions that average numbers of particles at the nodes: volume_record and average_rate, which are those
/// of stage/volume.hpp, and sum_average, a sum over the nodes along an axis.
template <class Kernel, int D>
void add_volume_average(Module& module) {
    using R = recorded;
    module.function<R, R>("volume_record", "firn/stage/volume.hpp: what a particle gives", {"rate", "volume"},
                          [](const R& rate, const R& initial) { return volume_record<D>(rate, initial); });
    module.function<R, R>("average_rate", "firn/stage/volume.hpp", {"rates", "volume"},
                          [](const R& sum, const R& initial) { return average_rate(sum, initial); });
    constexpr std::size_t K = std::size_t(Kernel::support);
    using OfAxis = std::array<R, K>;
    module.function<OfAxis, OfAxis>("sum_average", "firn/stage/g2p.hpp: the sum along an axis", {"parts", "w"},
                                    [](const OfAxis& parts, const OfAxis& w) {
                                        std::array<PartialSums<R, 0, false, false>, K> sums;
                                        for (std::size_t k = 0; k < K; ++k) sums[k].value = parts[k];
                                        return sum_axis<centre_node<Kernel>>(sums, w, w).value;
                                    });
}

/// Adds the functions of a volumetric policy that averages rates of volume change: rate_of, a particle's rate [1/s],
/// and with_average, what G2P takes from the grid with the average of the rates around the particle.
template <int D, class Volume>
void add_averaged_volume(Module& module, const Volume& volume) {
    using R = recorded;
    using Taken = G2PResult<R, D>;
    const std::string of_volume = std::string(Volume::name) + ", ";
    // The function that takes from the grid ends with products by one factor. Devices put it before their sum, if
    // nothing else needs the products.
    module.function<Taken>("rate_of", of_volume + "the rate of volume change", {"taken"}, [](Taken taken) {
        for (int i = 0; i < D; ++i) taken.velocity_gradient(i, i) = settled(taken.velocity_gradient(i, i));
        return trace(taken.velocity_gradient);
    });
    module.function<Taken, R>("with_average", of_volume + "with the average of the rates around", {"own", "average"},
                              [&](Taken taken, const R& average) {
                                  taken.velocity_gradient = volume.velocity_gradient(taken.velocity_gradient, average);
                                  return taken;
                              });
}

/// The solids of a recorded boundary. \see kept_out_of
template <class Boundary, int D>
struct RecordedSolids {
    Boundary boundary;           ///< the boundary, on the program's grid
    recorded h;                  ///< cell size [m]
    Vec<recorded, D> of_domain;  ///< lower corner of the domain [m]

    /// Calls seen(distance [cells], normal) for each solid.
    /// \param x  position [cells from the domain's lower corner]
    template <class Seen>
    void around(const Vec<recorded, D>& x, const Seen& seen) const {
        solids_around(boundary, of_domain + x * h, h,
                      [&](const recorded& distance, const Vec<recorded, D>& normal) { seen(distance / h, normal); });
    }
};

/// Adds the functions of particle shifting: those of stage/shifting.hpp for one node and one particle.
template <class Kernel, int D, class Boundary, class Material, class Volume>
void add_shifting(Module& module, const Boundary& boundary, const Material&, const Volume& volume) {
    using R = recorded;
    using V = Vec<R, D>;
    using Quad = Vec<R, 4>;
    using State = material_state_t<with_scalar_t<Material, R>, D>;
    const auto solids = [&] {
        const auto here = on_grid(detail::with_uniforms(boundary, "boundary"), detail::cell_size());
        return RecordedSolids<std::remove_const_t<decltype(here)>, D>{here, detail::cell_size(),
                                                                      detail::uniform_of<V>("domain_lower")};
    };
    const char* const of_stage = "firn/stage/shifting.hpp";
    module.function<R>("shifted_share_of", std::string(Volume::name) + ", the share that one pass of shifting removes",
                       {"crossed"}, [&](const R& crossed) { return volume.shifted_share(crossed); });
    module.function<State, R>("present_volume_of", "firn/stage/volume_filter.hpp: J V0", {"state", "volume"},
                              [](const State& state, const R& initial) { return present_volume(state, initial); });
    module.function<R, R, R>(
        "room_along", of_stage, {"node", "lower", "upper"},
        [](const R& node, const R& lower, const R& upper) { return room_along<Kernel>(node, lower, upper); });
    module.function<R, V>(
        "room_beside", std::string(Boundary::name) + ", " + of_stage + ": the room beside solids", {"room", "node"},
        [&](const R& room, const V& node) {
            R free = room;
            solids().around(node, [&](const R& distance, const V&) { free = free * room_outside<Kernel>(distance); });
            return free;
        });
    module.function<R, R>("excess_of", of_stage, {"volume", "room"}, [](const R& matter, const R& room) {
        return excess_volume(matter * detail::uniform("per_volume"), room);
    });
    detail::add_axis_sums<Kernel, D, 0, false, true, Quad>(module, "sum_quads");
    using Sums = PartialSums<Quad, D, false, true>;
    module.function<Sums, V, V, R>(
        "shifted_by", std::string(Boundary::name) + ", " + of_stage + ": where a particle goes, from `corner`",
        {"sums", "place", "corner", "share"}, [&](const Sums& of, const V& place, const V& corner, const R& share) {
            ShiftSums<R, D> sums{of.value[0], of.value[1], {}, {}};
            for (int a = 0; a < D; ++a) {
                sums.excess_gradient[a] = of.gradient[std::size_t(a)][0];
                sums.room_gradient[a] = of.gradient[std::size_t(a)][1];
            }
            const V x = corner + place;
            V way = kept_in_box(shift_of(sums, share), x, detail::uniform_of<V>("room_lower"),
                                detail::uniform_of<V>("room_upper"));
            if constexpr (may_have_solids<Boundary, float, D>) way = kept_out_of(solids(), x, way);
            const auto moved = moved_by(way, R(1), place, V::zero() - corner, detail::uniform_of<V>("cells") - corner);
            return select(sums.excess > R(0), moved.position, place);
        });
}

}  // namespace firn::inline FIRN_BUILD::wgsl
