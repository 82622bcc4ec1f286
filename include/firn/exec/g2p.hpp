/// \file G2P over all particles: velocity, C, position, the material's state and its stress.
#pragma once

#include <firn/data/check_particles.hpp>
#include <firn/exec/execution.hpp>
#include <firn/exec/gather.hpp>
#include <firn/exec/parallel.hpp>
#include <firn/material/concept.hpp>

#include <limits>
#include <vector>

namespace firn {

/// What a G2P saw while it passed over the particles.
struct G2PReport {
    double signal_speed = 0;   ///< largest |v| + c [m/s]: bounds the next time step
    bool sort_needed = false;  ///< some particle may have left the reach of its block: partition before the next P2G
};

namespace detail {

/// Names the first particle of the range that is not finite or would have moved more than a cell beyond the domain.
template <class View, int D>
[[noreturn, gnu::cold]] void throw_wrong_particle(const View& view, const BlockPartition<D>& partition,
                                                  const BlockRange<D>& range, const Domain<D>& domain, double dt) {
    for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) {
        const Slots slots{slot, partition.order.data() + slot};
        bool finite = true, inside = true;
        for (int a = 0; a < D; ++a) {
            const double v = double(view.velocity.at(slots, a));
            finite = finite && std::isfinite(double(view.position.at(slots, a))) && std::isfinite(v);
            inside = inside && dt * std::abs(v) <= domain.cell_size;
        }
        for (int k = 0; k < symmetric_size<D>; ++k) finite = finite && std::isfinite(double(view.stress.at(slots, k)));
        if (finite && inside) continue;
        const auto position = [&](std::size_t, int a) { return double(view.position.at(slots, a)); };
        const auto velocity = [&](std::size_t, int a) { return double(view.velocity.at(slots, a)); };
        throw particle_error(sentence("Particle ", partition.order[slot], " at ", point_text(slot, D, position),
                                      " m with velocity ", point_text(slot, D, velocity), " m/s ",
                                      finite ? "has left the domain" : "is not finite any more", " after a step of ",
                                      dt,
                                      " s. Compare the step with the bound of the time step, and look for a force or a "
                                      "stiffness that is too large."));
    }
    // Its stress was finite, its deformation gradient not: there is no telling which of the block it was.
    throw particle_error(sentence("One of the ", range.particles, " particles from particle ",
                                  partition.order[range.first_slot], " on is not finite any more after a step of ", dt,
                                  " s. Compare the step with the bound of the time step."));
}

}  // namespace detail

/// Grid to particles: interpolates velocities, moves the particles, updates the material's state and stress.
/// Particles are kept inside the domain.
/// \throws particle_error naming the first particle that is not finite or has left the domain
template <class Kernel, class Transfer, class Force, class Execution, class Material, std::floating_point S, int D,
          class Field, class State>
G2PReport g2p(const Execution& execution, const ParticleView<S, D, Field, State>& view,
              const BlockPartition<D>& partition, const SparseGrid<S, D>& grid, const Material& material, double dt) {
    static_assert(require_material<Material, D>() && require_kernel<Kernel>());
    using P = native_pack<S>;
    constexpr int lanes = scalar_traits<P>::lanes;
    using LiftedState = material_state_t<with_scalar_t<Material, P>, D>;
    const Domain<D>& domain = grid.domain();
    const auto lifted = lift<P>(material);
    const int threads = thread_count(requested_threads(execution));

    struct alignas(64) ThreadReport {
        double signal_speed = 0;
        bool sort_needed = false;
        std::size_t wrong_range = std::numeric_limits<std::size_t>::max();
    };
    std::vector<ThreadReport> reports{std::size_t(threads)};

    parallel_for(partition.ranges.size(), threads, [&](std::size_t r, int thread) {
        const BlockRange<D>& range = partition.ranges[r];
        const BlockFrame<S, D> frame(domain, range.block);
        Vec<P, D> lowest, highest;
        for (int a = 0; a < D; ++a) {
            lowest[a] = P(S(domain.lower[a]));
            highest[a] = P(S(domain.upper[a]));
        }
        const P h = P(S(domain.cell_size)), step = P(S(dt));
        Arena<Kernel, S, D> arena;
        std::fill(std::end(arena.node) - 4 * node_width, std::end(arena.node), S(0));
        Arena<Kernel, S, D>::for_runs(grid, grid.neighbours(r), [&](int to, const S* from, auto count) FIRN_LAMBDA {
            unroll<count>([&](auto k) FIRN_LAMBDA {
                quad<S>::load(from + k * node_width).store(arena.node + to + k * node_width);
            });
        });

        P speed = P(0), rightness = P(0);
        mask_t<P> stray = P(1) < P(0);
        PackSums<Kernel, Transfer, Force, S, D> sums;
        for (std::size_t p = 0; p < range.packs(); ++p) {
            const std::size_t pack_slot = range.first_slot + p * pack_size;
            for (int lane = 0; lane < pack_size; lane += lanes) {
                const Slots slots{pack_slot + std::size_t(lane), partition.order.data() + pack_slot + lane};
                sums.weights.fill(lane, locate<Kernel>(load_vector<P, D>(view.position, slots), frame));
            }
            for (int l = 0; l < pack_size; ++l) sums.gather(l, arena.node);
            for (int lane = 0; lane < pack_size; lane += lanes) {
                const Slots slots{pack_slot + std::size_t(lane), partition.order.data() + pack_slot + lane};
                const Vec<P, D> x = load_vector<P, D>(view.position, slots);
                const Place<P, D> place = locate<Kernel>(x, frame);
                const G2PResult<P, D> taken =
                    take_from_grid<Kernel, Transfer, Force>(sums.lanes(lane), from_centre<Kernel>(place.fraction), h);
                const P mass = view.mass.template load_or_zero<P>(slots, 0);
                const auto real = mass > P(0);

                LiftedState state = load_state<LiftedState>(view.state, slots);
                state = updated(lifted, state, taken.velocity_gradient, step);
                const Mat<P, D> stress = kirchhoff_stress(lifted, state);
                store_state(view.state, slots, state);
                store_symmetric(view.stress, slots, stress);
                if constexpr (Transfer::affine)
                    unroll<D * D>([&](auto k) FIRN_LAMBDA { view.affine.store(slots, k, taken.affine.m[k]); });

                // A sum that is finite exactly if all its numbers are (they are far from overflow, or wrong already).
                P sum = trace(stress);
                Vec<P, D> new_position;
                unroll<D>([&](auto a) FIRN_LAMBDA {
                    const P moved = x.v[a] + taken.velocity.v[a] * step;
                    const P outside = max(lowest.v[a] - moved, moved - highest.v[a]);
                    sum = sum + taken.velocity.v[a] + select(outside <= h, P(0), P(std::numeric_limits<S>::infinity()));
                    const P kept =
                        select(moved < lowest.v[a], lowest.v[a], select(moved > highest.v[a], highest.v[a], moved));
                    new_position.v[a] = select(real, kept, x.v[a]);
                    view.position.store(slots, a, new_position.v[a]);
                    view.velocity.store(slots, a, taken.velocity.v[a]);
                });
                stray = stray | (real & strays<Kernel>(new_position, frame));
                rightness = rightness + select(real, sum * P(0), P(0));  // 0, or NaN once a sum was not finite
                const P density = mass / select(real, view.volume.template load<P>(slots, 0), P(1));
                const P signal = norm(taken.velocity) + wave_speed(lifted, select(real, density, P(1)), state);
                speed = max(speed, select(real, signal, P(0)));
            }
        }
        ThreadReport& report = reports[std::size_t(thread)];
        report.signal_speed = std::max(report.signal_speed, double(reduce_max(speed)));
        report.sort_needed = report.sort_needed || any(stray);
        if (any(!(rightness == P(0)))) report.wrong_range = std::min(report.wrong_range, r);
    });

    G2PReport report;
    std::size_t wrong_range = std::numeric_limits<std::size_t>::max();
    for (const ThreadReport& of_thread : reports) {
        report.signal_speed = std::max(report.signal_speed, of_thread.signal_speed);
        report.sort_needed = report.sort_needed || of_thread.sort_needed;
        wrong_range = std::min(wrong_range, of_thread.wrong_range);
    }
    if (wrong_range < partition.ranges.size())
        detail::throw_wrong_particle(view, partition, partition.ranges[wrong_range], domain, dt);
    return report;
}

/// The stress and signal speed of particles as they are: before the first step, and after a state was changed by hand.
template <class Execution, class Material, std::floating_point S, int D, class Field, class State>
G2PReport update_stress(const Execution& execution, const ParticleView<S, D, Field, State>& view,
                        const BlockPartition<D>& partition, const Material& material) {
    using P = native_pack<S>;
    using LiftedState = material_state_t<with_scalar_t<Material, P>, D>;
    const auto lifted = lift<P>(material);
    std::vector<double> speeds(partition.ranges.size());
    parallel_for(partition.ranges.size(), thread_count(requested_threads(execution)), [&](std::size_t r, int) {
        const BlockRange<D>& range = partition.ranges[r];
        P speed = P(0);
        for (std::size_t lane = 0; lane < range.packs() * pack_size; lane += scalar_traits<P>::lanes) {
            const Slots slots{range.first_slot + lane, partition.order.data() + range.first_slot + lane};
            const LiftedState state = load_state<LiftedState>(view.state, slots);
            store_symmetric(view.stress, slots, kirchhoff_stress(lifted, state));
            const P mass = view.mass.template load_or_zero<P>(slots, 0);
            const auto real = mass > P(0);
            const P density = select(real, mass, P(1)) / select(real, view.volume.template load<P>(slots, 0), P(1));
            const P signal = norm(load_vector<P, D>(view.velocity, slots)) + wave_speed(lifted, density, state);
            speed = max(speed, select(real, signal, P(0)));
        }
        speeds[r] = double(reduce_max(speed));
    });
    G2PReport report;
    for (double speed : speeds) report.signal_speed = std::max(report.signal_speed, speed);
    return report;
}

}  // namespace firn
