/// \file Finds and describes wrong particles: those that have a value that is not finite, or that have left the domain.
/// The search runs only after a step has reported that there are such particles.
///
/// A template collects the facts about a particle. The code that writes sentences is not a template, so it is compiled
/// only once.
#pragma once

#include <firn/data/check_particles.hpp>
#include <firn/loops/places.hpp>
#include <firn/stage/surroundings.hpp>
#include <firn/stage/time_step.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace firn::inline FIRN_BUILD::detail {

/// Facts about one particle, for use in messages.
struct ParticleFacts {
    std::uint32_t id = 0;
    int dimension = 0;
    bool has_position = false;  ///< whether `position` is known; false if it is in cells and no domain is given
    double position[3] = {};    ///< position x [m]
    double velocity[3] = {};    ///< velocity v [m/s]
    double volume_ratio = 0;    ///< J: determinant of the first matrix in the particle's state
    bool has_volume_ratio = false;
    double signal_speed = 0;      ///< |v| + c [m/s]. \see firn::signal_speed
    double undeformed_speed = 0;  ///< wave speed in undeformed matter of the particle's density [m/s]
    std::string not_finite{};     ///< for example "not finite: its velocity, its stress"; empty if all is finite
    bool at_face = false;         ///< whether the particle lies on a face of the domain, where G2P has stopped it
    bool has_passed = false;      ///< whether the particle would have moved more than a cell out of the domain

    double speed() const;
    /// Returns a text like "particle 7 at (1, 2) m with velocity (3, 4) m/s, J = 1".
    [[gnu::cold]] std::string text() const;
    /// Adds the name of a field to `not_finite` if one of the field's values is not finite.
    [[gnu::cold]] void look_at(const char* name, const double* numbers, int components);
};

/// The base class of objects that receive the facts about particles, one particle after the other.
struct FactsReader {
    virtual void see(ParticleFacts& one) = 0;

protected:
    ~FactsReader() = default;
};

/// Collects wrong particles: those that have a value that is not finite, or that would have moved more than a cell out
/// of the domain. If `by_velocity` is false, collects the particles at a face of the domain instead.
struct WrongParticles final : FactsReader {
    std::size_t count = 0,    ///< number of wrong particles
        of = 0;               ///< number of all particles
    bool by_velocity = true;  ///< true: collects by not_finite and has_passed; false: by at_face

    [[gnu::cold]] void see(ParticleFacts& one) override;
    /// Returns sentences like "3 of 100 particles are not finite, or left the domain. The first is …". The caller adds
    /// the cause.
    [[gnu::cold]] std::string text() const;

private:
    std::array<std::uint32_t, 5> lowest_{};  // lowest ids of wrong particles, ascending
    ParticleFacts first_;
};

/// Computes the signal speed and the undeformed wave speed of a particle. Material models work on SIMD registers, all
/// lanes of which hold this one particle here.
template <class View, class Material>
[[gnu::cold]] void find_speeds(const View& view, const Slots& slots, double cell_size, const Material& material,
                               ParticleFacts& facts) {
    using S = typename View::scalar_type;
    using P = native_pack<S>;
    constexpr int D = View::dimension;
    const auto lifted = lift<P>(material);
    material_state_t<decltype(lift<P>(material)), D> state;
    constexpr auto members = decltype(state)::fields();
    unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto f) {
        auto& member = state.*(std::get<f>(members).member);
        member = value_of<std::remove_cvref_t<decltype(member)>>(view.state[f],
                                                                 [&](auto k) { return P(view.state[f].at(slots, k)); });
    });
    Vec<P, D> velocity;
    for (int a = 0; a < D; ++a) velocity[a] = P(view.velocity.at(slots, a));
    const P mass = P(view.mass.at(slots, 0)), volume = P(view.volume.at(slots, 0));
    // The position and the time are not known here.
    const auto& here = placed<D>(
        lifted, [&] { return surroundings_of(Vec<P, D>::zero(), velocity, mass, volume, P(S(cell_size)), P(0)); });
    facts.signal_speed =
        double(lane_value(firn::signal_speed(here, velocity, mass, volume, state, P(S(cell_size))), 0));
    facts.undeformed_speed = double(lane_value(wave_speed(here, mass / volume, initial_state<D>(lifted)), 0));
}

/// Collects the facts about one particle.
/// \param domain  nullptr if the domain is not known
/// \param dt      time step that moved the particle [s]; 0 if no step moved it
template <int D, class View, class Material>
[[gnu::cold]] void find_facts(const View& view, const BlockRange<D>& range, const Slots& slots, const Domain<D>* domain,
                              double cell_size, const Material& material, double dt, ParticleFacts& facts) {
    using S = typename View::scalar_type;
    const auto look = [&](const char* name, const auto& field, int components, double* numbers) {
        for (int k = 0; k < components; ++k) numbers[k] = double(field.at(slots, k));
        facts.look_at(name, numbers, components);
    };
    double numbers[9];
    facts.dimension = D;
    look("position", view.position, D, facts.position);
    look("velocity", view.velocity, D, facts.velocity);
    constexpr auto members = View::state_type::fields();
    unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto i) {
        constexpr auto member = std::get<i>(members);
        using Value = std::remove_cvref_t<decltype(std::declval<typename View::state_type>().*(member.member))>;
        look(member.name, view.state[i], component_count<Value>, numbers);
        if constexpr (deformation_gradient<Value>) {
            if (facts.has_volume_ratio) return;
            using InDouble = typename Stored<Value>::template With<double>;
            const auto F = value_of<InDouble>(view.state[i], [&](auto k) { return numbers[k]; });
            facts.volume_ratio = 1 + volume_change(F);
            facts.has_volume_ratio = true;
        }
    });
    look("stress", view.stress, symmetric_size<D>, numbers);
    find_speeds(view, slots, cell_size, material, facts);
    if (facts.not_finite.empty() && !std::isfinite(facts.signal_speed))
        facts.not_finite = "not finite: the speed of waves in it";

    facts.has_position = domain || !Positions<View>::in_cells;
    if (domain && Positions<View>::in_cells)
        for (int a = 0; a < D; ++a) facts.position[a] = position_of_place(*domain, range.block, a, facts.position[a]);
    if (!domain || !(dt > 0)) return;
    const Positions<View> positions(*domain);
    Vec<S, D> block{};
    for (int a = 0; a < D; ++a) block[a] = S(block_size * range.block[std::size_t(a)]);
    block[0] = S(block_size * along_in_domain(range.block[0], copy_stride(*domain)));
    const Vec<S, D> lowest = positions.lowest(block), highest = positions.highest(block);
    for (int a = 0; a < D; ++a) {
        const S x = view.position.at(slots, a);
        const bool low = x <= lowest[a], high = x >= highest[a];
        const double moved = dt * facts.velocity[a];
        facts.at_face = facts.at_face || low || high;
        facts.has_passed = facts.has_passed || ((low || high) && (low ? -moved : moved) > cell_size);
    }
}

/// Passes the facts about all particles of a set to a reader, one particle after the other.
template <int D, class View, class Material>
[[gnu::cold]] void read_facts(const View& view, const BlockPartition<D>& partition, const Domain<D>* domain,
                              double cell_size, const Material& material, double dt, FactsReader& reader) {
    for (const BlockRange<D>& range : partition.ranges)
        for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) {
            const Slots slots{slot, partition.order.data() + slot};
            ParticleFacts facts{partition.order[slot]};
            if (facts.id == no_particle) continue;
            find_facts(view, range, slots, domain, cell_size, material, dt, facts);
            reader.see(facts);
        }
}

/// Returns the wrong particles of a set. \see WrongParticles
/// \param particles  number of particles in the set
/// \param read       read(reader) tells a FactsReader of all particles; it is called once or twice
template <class Read>
[[gnu::cold]] WrongParticles wrong_particles(std::size_t particles, const Read& read) {
    WrongParticles wrong;
    wrong.of = particles;
    read(wrong);
    if (wrong.count > 0) return wrong;
    wrong.by_velocity = false;
    read(wrong);
    return wrong;
}

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/loops/wrong_particles-inl.hpp>
#endif
