/// \file G2P of all particles: computes the velocity, affine field C, position, material state and stress of each
/// particle.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/gather.hpp>
#include <firn/loops/layers.hpp>
#include <firn/loops/surroundings.hpp>
#include <firn/loops/wrong_particles.hpp>
#include <firn/material/check.hpp>
#include <firn/material/concept.hpp>
#include <firn/stage/time_step.hpp>
#include <firn/stage/volume.hpp>
#include <firn/transfer/concept.hpp>
#include <firn/volumetric/own_volume.hpp>

#include <algorithm>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The report of G2P about all particles.
struct G2PReport {
    double signal_speed = 0;   ///< largest signal speed |v| + c of all particles [m/s]; it limits the next time step
    bool sort_needed = false;  ///< true if a particle may be too far from its block: sort particles before the next P2G
};

namespace detail {

/// The report of a pass over all particles. `right` tells whether all values are finite and all particles lie in the
/// domain.
struct PassReport {
    G2PReport report;
    bool right = true;
};

[[noreturn]] inline void throw_wrong(const WrongParticles& wrong, const std::string& cause) {
    throw particle_error(wrong.text() + " " + cause);
}

/// Returns a value that is not finite if the stress, or the state from which the stress was computed, is not finite.
/// This value is the trace of the stress, which is not finite if the deformation gradient F is not finite. If the
/// stress depends on the strain rate, the value also includes the components of the stress below the diagonal.
template <class Material, class P, int D>
FIRN_INLINE P sum_of_stress(const Mat<P, D>& stress) {
    P sum = trace(stress);
    if constexpr (has_rate_dependent_stress<Material, D>)
        unroll<D>([&](auto i) FIRN_LAMBDA { unroll<i>([&](auto j) FIRN_LAMBDA { sum = sum + stress(i, j); }); });
    return sum;
}

/// The report of one thread about the particles that this thread has updated. The members mean the same as in G2PReport
/// and PassReport.
struct alignas(64) G2PThreadReport {
    double signal_speed = 0;
    bool sort_needed = false, right = true;
};

/// G2P of a group of particles, one pack (sixteen particles) after the other. First, the sums over the nodes around
/// each particle are computed, row by row. Then the particles of the pack are updated, one particle in each SIMD lane.
template <class Kernel, class Transfer, class Force, class Volume, class Material, class View>
class GroupUpdate {
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;
    using P = native_pack<S>;
    using Lifted = with_scalar_t<Material, P>;
    using LiftedState = material_state_t<Lifted, D>;
    static constexpr int lanes = scalar_traits<P>::lanes;

public:
    GroupUpdate(const View& view, const BlockPartition<D>& partition, const SparseGrid<S, D>& grid,
                const Material& material, const TimeStep& step, const Transfer& transfer)
        : view_(view),
          partition_(partition),
          grid_(grid),
          positions_(grid.domain()),
          surroundings_(grid.domain(), step.start),
          material_(lift<P>(material)),
          transfer_(lift<P>(transfer)),
          h_(S(grid.domain().cell_size)),
          dt_(S(step.dt)),
          per_velocity_(positions_.per_velocity(step, grid.domain().cell_size)) {}

    void operator()(std::size_t g, G2PThreadReport& report) const {
        const BlockGroup& group = partition_.groups[g];
        const GroupPlaces<View> places(view_, partition_, group, positions_);
        NodesOfGroup<Kernel, S, D, blended ? 2 : 1> nodes(grid_, partition_, group, places);
        PackPlaces<Kernel, g2p_needs_gradient<Kernel, Transfer, Force>, S, D> pack;
        TransferSums<Kernel, Transfer, Force, S, D> sums;
        std::conditional_t<blended, PackSums<Kernel, false, false, S, D>, NoSums> before;
        Seen seen;
        for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += pack_size) {
            prefetch(group.first_slot + slot + pack_size);
            nodes.locate(pack, places, slot);
            nodes.template gather<0>(pack, sums);
            if constexpr (blended) nodes.template gather<1>(pack, before);
            for (int lane = 0; lane < pack_size; lane += lanes)
                update(places.slots(slot + std::size_t(lane)),
                       places.blocks().template lower<P>(slot + std::size_t(lane)), pack.offset(lane), sums.lanes(lane),
                       average(sums, lane), before.lanes(lane).velocity, seen);
        }
        report.signal_speed = std::max(report.signal_speed, double(reduce_max(seen.speed)));
        report.sort_needed = report.sort_needed || any(seen.stray);
        report.right = report.right && !any(!(seen.rightness == P(0)));
    }

private:
    static constexpr bool blended = blends_velocities<Transfer>;
    /// Replaces PackSums if the transfer does not blend velocities. The velocities that lanes() returns are not used.
    struct NoSums {
        struct Lanes {
            Vec<P, D> velocity;
        };
        FIRN_INLINE static Lanes lanes(int) { return {}; }
    };

    /// Returns the average rate of volume change around one register of particles; nothing if Volume does not average.
    template <class Sums>
    FIRN_INLINE static auto average(const Sums& sums, int lane) {
        if constexpr (Volume::averages_volume)
            return sums.fourth(lane);
        else
            return NoSums{};
    }
    struct Seen {
        P speed = P(0);
        P rightness = P(0);  // 0 while all values are finite; NaN after a value was not finite
        mask_t<P> stray = P(1) < P(0);
    };

    /// Prefetches the values of the pack that begins at `slot` into the cache, including values that are only written.
    FIRN_INLINE void prefetch(std::size_t slot) const {
        view_.template prefetch<Transfer::affine>(slot);
        view_.prefetch_state(slot);
    }

    /// Updates the particles of one SIMD register.
    /// \param block   lower corners of the particles' blocks [cells from the domain's lower corner]
    /// \param offset  positions of the particles relative to their centre nodes [cells]
    /// \param average  the average rate of volume change; used only by volumetric policies that average
    /// \param before  Σ N_i v_i, with the weights N_i of the nodes, and the node velocities v_i before forces acted;
    ///                used only by transfers that blend velocities
    template <class Average>
    FIRN_INLINE void update(const Slots& slots, const Vec<P, D>& block, const Vec<P, D>& offset,
                            const G2PSums<P, D>& sums, [[maybe_unused]] const Average& average, const Vec<P, D>& before,
                            Seen& seen) const {
        const View view = view_;  // a local copy, so that the compiler computes addresses only once
        auto taken = take_from_grid<Kernel, Transfer, Force>(sums, offset, P(h_), transfer_);
        if constexpr (Volume::averages_volume) {
            P around = average;
            if constexpr (tells_plastic_volume<LiftedState>)
                around = around + load_state<LiftedState>(view.state, slots).plastic_volume_rate;
            taken.velocity_gradient = averaged_gradient<Volume>(taken.velocity_gradient, around, P(dt_));
        }
        const P mass = view.mass.template load_or_zero<P>(slots, 0);
        const auto real = mass > P(0);

        const auto& material = placed<D>(material_, [&] {
            return surroundings_(surroundings_.position(load_vector<P, D>(view.position, slots), block), taken.velocity,
                                 mass, view.volume.template load<P>(slots, 0));
        });
        LiftedState state = load_state<LiftedState>(view.state, slots);
        Mat<P, D> stress;
        if constexpr (has_stress_with_state<Lifted, D>) {
            const auto after = updated_with_stress(material, state, taken.velocity_gradient, P(dt_));
            state = after.state;
            stress = after.stress;
        } else {
            state = updated(material, state, taken.velocity_gradient, P(dt_));
        }
        store_state(view.state, slots, state);
        if constexpr (Transfer::affine)
            unroll<D * D>([&](auto k) FIRN_LAMBDA { view.affine.store(slots, k, taken.affine.m[k]); });

        // `sum` is not finite if one of its terms is not finite. If all terms are finite, `sum` can still overflow;
        // some of the terms are then so large that they must be wrong.
        const Vec<P, D> lowest = positions_.lowest(block), highest = positions_.highest(block);
        const Vec<P, D> position = load_vector<P, D>(view.position, slots);
        const auto v = velocities(view, slots, taken, before);
        const auto move = moved_by(v.motion, P(per_velocity_), position, lowest, highest);
        const Vec<P, D> new_position = select(real, move.position, position);
        P sum = select(move.outside <= P(positions_.cell()), P(0), P(std::numeric_limits<S>::infinity()));
        unroll<D>([&](auto a) FIRN_LAMBDA {
            sum = sum + v.velocity.v[a];
            view.position.store(slots, a, new_position.v[a]);
            view.velocity.store(slots, a, v.velocity.v[a]);
        });
        seen.stray = seen.stray | (real & strays<Kernel>(positions_.in_block(new_position, block)));
        const P volume = view.volume.template load<P>(slots, 0);
        const P speed = signal_speed(material, v.velocity, mass, volume, state, P(h_));
        seen.speed = max(seen.speed, speed);

        // The stress takes a long chain of operations. It is computed last, so that the operations above need not wait
        // for its result.
        if constexpr (!has_stress_with_state<Lifted, D>) stress = stress_of(material, state, taken.velocity_gradient);
        store_symmetric(view.stress, slots, stress);
        sum = sum + sum_of_stress<Lifted>(stress) + speed;
        seen.rightness = seen.rightness + select(real, sum * P(0), P(0));
    }

    /// Returns two velocities: the new velocity of the particles (`velocity`), and the velocity with which the
    /// particles are moved (`motion`).
    FIRN_INLINE auto velocities(const View& view, const Slots& slots, const G2PResult<P, D>& taken,
                                const Vec<P, D>& before) const {
        struct Taken {
            const Vec<P, D>&velocity, &motion;
        };
        if constexpr (blended)
            return transfer_.blended(taken.velocity, before, load_vector<P, D>(view.velocity, slots),
                                     taken.velocity_gradient);
        else
            return Taken{taken.velocity, taken.velocity};
    }

    const View& view_;
    const BlockPartition<D>& partition_;
    const SparseGrid<S, D>& grid_;
    Positions<View> positions_;
    SurroundingsInBlocks<View> surroundings_;
    Lifted material_;
    with_scalar_t<Transfer, P> transfer_;
    S h_, dt_, per_velocity_;
};

/// Does the work of g2p(), but does not throw a particle_error: if a particle has a value that is not finite or has
/// left the domain, it returns a report with `right` = false.
template <class Kernel, class Transfer, class Force, class Volume = OwnVolume, class Material, std::floating_point S,
          int D, class Field, class State>
PassReport g2p_pass(int threads, const ParticleView<S, D, Field, State>& view, const BlockPartition<D>& partition,
                    const SparseGrid<S, D>& grid, const Material& material, const TimeStep& step,
                    const Transfer& transfer) {
    static_assert(require_material<Material, D>() && require_kernel<Kernel>() && require_transfer<Transfer>());
    if constexpr (requires { transfer.check(); }) transfer.check();
    grid.require_active(partition);
    if (blends_velocities<Transfer> && grid.block_count() > 0 && !grid.layer(layer::before_forces))
        throw usage_error(
            "This transfer blends with the velocities that nodes had before forces acted, and the grid does "
            "not hold them. Call before_p2g() before every p2g().");
    if (partition.groups.empty()) return {};  // of many materials, a simulation may have particles of few
    const GroupUpdate<Kernel, Transfer, Force, Volume, Material, ParticleView<S, D, Field, State>> update(
        view, partition, grid, material, step, transfer);
    std::vector<G2PThreadReport> reports{std::size_t(threads)};
    parallel_for(partition.groups.size(), threads,
                 [&](std::size_t g, int thread) { update(g, reports[std::size_t(thread)]); });

    PassReport pass;
    for (const auto& of_thread : reports) {
        pass.report.signal_speed = std::max(pass.report.signal_speed, of_thread.signal_speed);
        pass.report.sort_needed = pass.report.sort_needed || of_thread.sort_needed;
        pass.right = pass.right && of_thread.right;
    }
    return pass;
}

/// Returns the sum of all values of a state. The sum is not finite if one of the values is not finite.
template <class P, class State>
FIRN_INLINE P sum_of_state(const State& state) {
    constexpr auto members = State::fields();
    P sum = P(0);
    unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto f) FIRN_LAMBDA {
        const auto& member = state.*(std::get<f>(members).member);
        const auto numbers = Stored<std::remove_cvref_t<decltype(member)>>::numbers(member);
        unroll<int(numbers.size())>([&](auto k) FIRN_LAMBDA { sum = sum + numbers[k]; });
    });
    return sum;
}

/// Does the work of update_stress(), but does not throw a particle_error: if a particle has a value that is not finite,
/// it returns a report with `right` = false.
/// \param around  a surroundings_for the material
template <class Material, std::floating_point S, int D, class Field, class State, class Around>
PassReport update_stress_pass(int threads, const ParticleView<S, D, Field, State>& view,
                              const BlockPartition<D>& partition, const Material& material, double cell_size,
                              const Around& around) {
    using P = native_pack<S>;
    using LiftedState = material_state_t<with_scalar_t<Material, P>, D>;
    const auto lifted = lift<P>(material);
    const std::size_t packs = partition.slots() / pack_size;
    aligned_vector<double> speeds;
    aligned_vector<std::uint8_t> right;
    renew(speeds, packs, threads);
    renew(right, packs, threads);
    parallel_for(
        packs, threads,
        [&](std::size_t pack, int) {
            P speed = P(0), rightness = P(0);
            for (std::size_t lane = 0; lane < pack_size; lane += scalar_traits<P>::lanes) {
                const std::size_t slot = pack * pack_size + lane;
                const Slots slots{slot, partition.order.data() + slot};
                const LiftedState state = load_state<LiftedState>(view.state, slots);
                const P mass = view.mass.template load_or_zero<P>(slots, 0);
                const P volume = view.volume.template load<P>(slots, 0);
                const Vec<P, D> velocity = load_vector<P, D>(view.velocity, slots);
                const auto& own_material = placed_in<D>(lifted, around, slots);
                Mat<P, D> stress;
                if constexpr (has_rate_dependent_stress<with_scalar_t<Material, P>, D>) {
                    Mat<P, D> C = Mat<P, D>::zero();
                    if (view.affine.data)
                        unroll<D * D>([&](auto k) FIRN_LAMBDA { C.m[k] = view.affine.template load<P>(slots, k); });
                    stress = stress_of(own_material, state, C);
                } else {
                    stress = kirchhoff_stress(own_material, state);
                }
                store_symmetric(view.stress, slots, stress);
                const P own = signal_speed(own_material, velocity, mass, volume, state, P(S(cell_size)));
                P sum = own;
                unroll<D * D>([&](auto k) FIRN_LAMBDA { sum = sum + stress.m[k]; });
                unroll<D>([&](auto a) FIRN_LAMBDA { sum = sum + velocity.v[a]; });
                sum = sum + sum_of_state<P>(state);
                rightness = rightness + select(mass > P(0), sum * P(0), P(0));
                speed = max(speed, own);
            }
            speeds[pack] = double(reduce_max(speed));
            right[pack] = !any(!(rightness == P(0)));
        },
        64);
    PassReport pass;
    for (double speed : speeds) pass.report.signal_speed = std::max(pass.report.signal_speed, speed);
    pass.right = std::find(right.begin(), right.end(), 0) == right.end();
    return pass;
}

/// Returns true if a material needs nothing that only a Simulation knows; else the compilation stops with a message.
template <class Material, int D>
consteval bool require_no_surroundings() {
    static_assert(!asks_surroundings<Material, D>,
                  "firn: a material with a function at(surroundings) needs a firn::Simulation, which knows the time.");
    return !asks_surroundings<Material, D>;
}

}  // namespace detail

/// Grid to particles: interpolates node velocities to the particles, moves the particles, and updates the material
/// state and the stress of each particle. Particles are kept inside the domain. If the transfer blends velocities,
/// before_p2g() must be called before p2g().
/// \see loops/transfer_passes.hpp
/// \tparam Volume  a volumetric policy. If it averages rates of volume change, average_volume() must be called before
///                 this function. \see loops/volume_passes.hpp
/// \param dt  time step [s]
/// \throws parameter_error  if `dt` is negative or not finite, or if a parameter of the material is out of range
/// \throws usage_error      if the grid was not activated for this partition
/// \throws particle_error   if a particle has a value that is not finite, or would have moved more than a cell out of
///                          the domain. The message gives the number of such particles, and describes the one with the
///                          lowest id.
template <class Kernel, class Transfer, class Force, volumetric Volume = OwnVolume, class Execution, class View,
          class Material, int N, std::floating_point S, int D>
G2PReport g2p(const Execution& execution, const View& view, const BlockPartition<N>& partition,
              const SparseGrid<S, D>& grid, const Material& material, double dt, const Transfer& transfer = {}) {
    if constexpr (detail::require_same_kind<View, N, S, D>() && require_material<Material, D>()) {
        if constexpr (detail::require_same_precision<Material, S>() && detail::require_no_surroundings<Material, D>()) {
            check_material<D>(material);
            detail::check_step(dt);
            const auto pass = detail::g2p_pass<Kernel, Transfer, Force, Volume>(
                detail::threads_of(execution), view, partition, grid, material, dt, transfer);
            if (pass.right) return pass.report;
            detail::throw_wrong(detail::wrong_particles(partition.particles,
                                                        [&](auto& reader) {
                                                            detail::read_facts(view, partition, &grid.domain(),
                                                                               grid.domain().cell_size, material, dt,
                                                                               reader);
                                                        }),
                                sentence("They come from a step of ", dt,
                                         " s: compare it with the bound of the time step, and look for a force or a "
                                         "stiffness that is too large."));
        }
    }
    return {};
}

/// Computes stresses and signal speeds from the particles' states. Call it before the first step, and after the program
/// has changed a state. If the stress depends on the strain rate, the affine field C of a particle is used as the
/// velocity gradient of the particle. If the view has no affine field, the velocity gradient is taken to be zero.
/// \param cell_size  cell size h of the grid [m]
/// \throws parameter_error  if a parameter of the material is out of range
/// \throws particle_error   if a particle has a value that is not finite. The message gives the number of such
///                          particles, and describes the one with the lowest id.
template <class Execution, class Material, std::floating_point S, int D, class Field, class State>
G2PReport update_stress(const Execution& execution, const ParticleView<S, D, Field, State>& view,
                        const BlockPartition<D>& partition, const Material& material, double cell_size) {
    static_assert(detail::require_no_surroundings<Material, D>());
    check_material<D>(material);
    const auto pass = detail::update_stress_pass(detail::threads_of(execution), view, partition, material, cell_size,
                                                 detail::NoSurroundings());
    if (!pass.right)
        detail::throw_wrong(detail::wrong_particles(partition.particles,
                                                    [&](auto& reader) {
                                                        detail::read_facts(view, partition,
                                                                           static_cast<const Domain<D>*>(nullptr),
                                                                           cell_size, material, 0, reader);
                                                    }),
                            "Look at what velocities and states were set to, and at the moduli.");
    return pass.report;
}

}  // namespace firn::inline FIRN_BUILD
