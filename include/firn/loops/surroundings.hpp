/// \file The surroundings of particles, for materials that ask for them.
#pragma once

#include <firn/data/memory.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/data/particle_store.hpp>
#include <firn/loops/places.hpp>
#include <firn/stage/surroundings.hpp>

namespace firn::inline FIRN_BUILD::detail {

/// Computes the surroundings of the particles in a register.
template <class View>
class SurroundingsInBlocks {
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;

public:
    /// \param time  [s]
    SurroundingsInBlocks(const Domain<D>& domain, double time)
        : lower_(cast<S>(domain.lower)), h_(S(domain.cell_size)), time_(S(time)) {}

    /// Returns positions [m]. \param position  as they are stored
    /// \param block  lower corners of the blocks [cells from the domain's lower corner]
    template <class P>
    FIRN_INLINE Vec<P, D> position(const Vec<P, D>& position, const Vec<P, D>& block) const {
        if constexpr (Positions<View>::in_cells)
            return position_of(cast<P>(lower_), block, position, P(h_));
        else
            return position;
    }
    /// \param position  [m];  \param mass, volume  [kg], [m^D]; those of padding may be zero
    template <class P>
    FIRN_INLINE Surroundings<P, D> operator()(const Vec<P, D>& position, const Vec<P, D>& velocity, const P& mass,
                                              const P& volume) const {
        return surroundings_of(position, velocity, mass, volume, P(h_), P(time_));
    }

private:
    Vec<S, D> lower_;
    S h_, time_;
};

/// Knows the surroundings of all particles of a set, outside of G2P: the velocity is the particle's own. It keeps the
/// positions of all slots.
template <class View>
class SurroundingsOfSet {
    using S = typename View::scalar_type;
    static constexpr int D = View::dimension;
    using P = native_pack<S>;

public:
    /// \param time  [s]
    template <int N>
    SurroundingsOfSet(const View& view, const BlockPartition<N>& partition, const Domain<D>& domain, double time)
        : view_(view), in_blocks_(domain, time), positions_(partition.slots() * std::size_t(D)) {
        for (const BlockGroup& group : partition.groups) {
            const BlocksOfSlots<S, D> blocks(partition, group);
            for (std::size_t slot = 0; slot < group.packs() * pack_size; slot += scalar_traits<P>::lanes) {
                const Slots slots{group.first_slot + slot, partition.order.data() + group.first_slot + slot};
                const auto x =
                    in_blocks_.position(load_vector<P, D>(view.position, slots), blocks.template lower<P>(slot));
                unroll<D>([&](auto a) FIRN_LAMBDA { span().store(slots, a, x.v[a]); });
            }
        }
    }
    /// Returns the surroundings of the particles in some slots.
    FIRN_INLINE Surroundings<P, D> operator()(const Slots& slots) const {
        return in_blocks_(load_vector<P, D>(span(), slots), load_vector<P, D>(view_.velocity, slots),
                          view_.mass.template load_or_zero<P>(slots, 0), view_.volume.template load<P>(slots, 0));
    }

private:
    BlockedSpan<S> span() const { return {const_cast<S*>(positions_.data()), D}; }

    View view_;
    SurroundingsInBlocks<View> in_blocks_;
    aligned_vector<S> positions_;
};

/// Returns the surroundings of one particle, outside of a step: the velocity is its own.
/// \tparam T     the scalar of the material that asks
/// \param time  [s]
template <std::floating_point T, std::floating_point S, int D>
Surroundings<T, D> surroundings_of_particle(const ParticleStore<S, D>& particles, std::size_t slot, double time) {
    return surroundings_of(cast<T>(particles.exact_position(slot)), cast<T>(particles.velocity(slot)),
                           T(particles.mass(slot)), T(particles.volume(slot)), T(particles.domain().cell_size),
                           T(time));
}

/// Stands for the surroundings of a set whose material does not ask.
struct NoSurroundings {
    /// Takes what SurroundingsOfSet takes.
    template <class... A>
    explicit NoSurroundings(const A&...) {}
};
/// SurroundingsOfSet for a material that asks, else NoSurroundings.
template <class Material, class View>
using surroundings_for =
    std::conditional_t<asks_surroundings<Material, View::dimension>, SurroundingsOfSet<View>, NoSurroundings>;

/// Returns the material for the particles in some slots. \param around  a surroundings_for the material
template <int D, class M, class Around>
FIRN_INLINE decltype(auto) placed_in(const M& material, [[maybe_unused]] const Around& around,
                                     [[maybe_unused]] const Slots& slots) {
    if constexpr (std::same_as<Around, NoSurroundings>)
        return (material);
    else
        return placed<D>(material, [&] { return lift_surroundings<material_scalar_t<M>>(around(slots)); });
}

}  // namespace firn::inline FIRN_BUILD::detail
