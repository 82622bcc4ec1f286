/// \file Warnings of a simulation about input that is valid, but probably not intended. Each warning is given once.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/samples.hpp>
#include <firn/field/gravity.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/set_of.hpp>
#include <firn/simulation/slow_strain.hpp>
#include <firn/simulation/solid_warnings.hpp>
#include <firn/simulation/walls_between_nodes.hpp>
#include <firn/stage/volume.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

template <int D>
std::string text_of(const Vec<double, D>& x) {
    return point_text(x.v, D);
}

/// Returns a sentence if the boundary has walls that do not coincide with the faces of the domain; otherwise an empty
/// string.
template <class Boundary, int D>
std::string other_walls(const Boundary& boundary, const Domain<D>& domain) {
    if constexpr (requires { boundary.at_lower[D - 1], Vec<double, D>(cast<double>(boundary.lower)); }) {
        const Vec<double, D> lower = cast<double>(boundary.lower), upper = cast<double>(boundary.upper);
        bool same = true;
        for (int a = 0; a < D; ++a) {
            const double near = 1e-6 * (std::abs(lower[a]) + std::abs(upper[a])) + 1e-3 * domain.cell_size;
            same = same && std::abs(lower[a] - domain.lower[a]) <= near && std::abs(upper[a] - domain.upper[a]) <= near;
        }
        if (same) return {};
        return sentence("the walls reach from ", text_of(lower), " m to ", text_of(upper), " m, the domain from ",
                        text_of(domain.lower), " m to ", text_of(domain.upper),
                        " m: nothing holds matter outside the walls, and matter that reaches the end of the domain "
                        "before a wall stops the run. Give both the same corners.");
    } else if constexpr (requires { boundary.parts; }) {
        std::string text;
        std::apply(
            [&](const auto&... part) { ((text.empty() ? void(text = other_walls(part, domain)) : void()), ...); },
            boundary.parts);
        return text;
    } else if constexpr (acts_by_gap<Boundary>) {
        return other_walls(boundary.boundary, domain);
    } else {
        return {};
    }
}

/// Returns a sentence if the domain is so far from 0 that positions in type S have too few digits to be of use;
/// otherwise an empty string.
template <std::floating_point S, int D>
std::string few_digits(const Domain<D>& domain) {
    const double digit = last_digit<S>(farthest_coordinate(domain));
    if (!(digit > 0.05 * domain.cell_size)) return {};
    return sentence("positions of up to ", farthest_coordinate(domain),
                    " m are given and written to states in a precision "
                    "whose last digit there is ",
                    digit, " m, with cells of ", domain.cell_size,
                    " m. Steps are not affected: they measure from the domain's corner. To read positions, compute in "
                    "double, or put the origin near the domain.");
}

/// One particle of a body, with the values that the warnings need.
template <int D>
struct ParticleOfBody {
    std::size_t body;  ///< index of the particle's body, counted over the bodies of all sets
    std::uint32_t id;
    double volume;       ///< volume of the particle [m^D]
    Vec<double, D> x{};  ///< position [m]
};
/// Calls see(particle) for every particle of every body.
template <std::floating_point S, int D>
[[gnu::cold]] void for_particles(const SetList<S, D>& sets,
                                 const std::type_identity_t<std::function<void(const ParticleOfBody<D>&)>>& see);

/// Returns a sentence if particles lie inside a solid of the boundary, deeper than a tenth of a cell; otherwise an
/// empty string.
template <std::floating_point S, int D, class Boundary>
[[gnu::cold]] std::string matter_in_solids(const SetList<S, D>& sets, const Domain<D>& domain,
                                           const Boundary& boundary) {
    if constexpr (!has_surfaces<Boundary, S, D>) {
        return {};
    } else {
        std::size_t inside = 0, all = 0;
        double deepest = 0.1 * domain.cell_size;
        ParticleOfBody<D> where{};
        const auto here = measured_from(boundary, domain.lower);
        for_particles(sets, [&](const ParticleOfBody<D>& one) {
            double depth = 0;
            here.surfaces(cast<S>(one.x - domain.lower),
                          [&](S distance, const auto&, const auto&, Contact contact, const auto&) {
                              if (contact != Contact::none) depth = std::max(depth, -double(distance));
                          });
            ++all;
            inside += depth > 0.1 * domain.cell_size;
            if (depth > deepest) where = one;
            deepest = std::max(deepest, depth);
        });
        if (inside == 0) return {};
        return sentence(inside, " of ", all, " particles lie inside a solid of the boundary, particle ", where.id,
                        " at ", text_of(where.x), " m the deepest, by ", deepest,
                        " m: the solid holds them, and they do not come out. Move the body or the solid, or leave out "
                        "such positions before you add them.");
    }
}

/// Returns a sentence about the first two bodies that overlap; an empty string if no bodies overlap.
template <std::floating_point S, int D>
[[gnu::cold]] std::string overlapping_bodies(const SetList<S, D>& sets);

/// Returns whether every face of the domain has a wall. The faces of periodic axes need no wall.
template <class Boundary, int D>
bool has_all_walls(const Boundary& boundary, const Domain<D>& domain) {
    bool has = false;
    if constexpr (requires { boundary.at_lower[D - 1].contact; }) {
        has = true;
        for (std::size_t a = 0; a < std::size_t(D); ++a)
            has = has && (domain.periodic[a] || (boundary.at_lower[a].contact != Contact::none &&
                                                 boundary.at_upper[a].contact != Contact::none));
    } else if constexpr (requires { boundary.parts; }) {
        std::apply([&](const auto&... part) { has = (has_all_walls(part, domain) || ...); }, boundary.parts);
    } else if constexpr (acts_by_gap<Boundary>) {
        has = has_all_walls(boundary.boundary, domain);
    }
    return has;
}

/// Whether a field with a gravity of its own is nothing but gravity, so that its gravity is meant as it is.
template <class Field>
inline constexpr bool is_gravity_alone = false;
template <class S, int D>
inline constexpr bool is_gravity_alone<Gravity<S, D>> = true;

/// Returns a sentence about an acceleration field that has a gravity of its own, left at zero, where the simulation has
/// one, which the field replaces; else an empty string.
template <int D, class Acceleration>
std::string lost_gravity(const Acceleration& acceleration, const Vec<double, D>& gravity) {
    if constexpr (requires { acceleration.field.gravity[D - 1]; }) {
        if (norm(gravity) > 0 && norm(cast<double>(acceleration.field.gravity)) == 0)
            return sentence("the acceleration that is given replaces the simulation's gravity of ", text_of(gravity),
                            " m/s^2, and has none: nothing falls. Give it one, as in firn::Damped<float, ", D,
                            ">{.field = {.gravity = …}, .rate = …}, or set simulation.gravity to zero.");
    } else if constexpr (requires { acceleration.gravity[D - 1]; } && !is_gravity_alone<Acceleration>) {
        if (norm(gravity) > 0 && norm(cast<double>(acceleration.gravity)) == 0)
            return sentence("the acceleration that is given replaces the simulation's gravity of ", text_of(gravity),
                            " m/s^2, and has none: nothing falls. Set its member `gravity`, or set simulation.gravity "
                            "to zero.");
    }
    return {};
}

/// The warnings of a simulation. The object remembers which warnings were already given.
class Warnings {
public:
    using Warn = std::function<void(const std::string&)>;

    /// Returns a warning if the bound of the time step [s] has fallen below 1/1000 of its largest value, or is below
    /// 10⁻⁶ s; otherwise an empty string.
    /// \param reason  a function without arguments that returns a sentence about what limits the time step
    std::string of_bound(double bound, std::uint64_t step, double time, const std::function<std::string()>& reason);

    /// Returns a warning if the fixed time step [s] is above the bound [s], and their ratio has grown by at least a
    /// fifth since the last warning; otherwise an empty string.
    /// \param by_acceleration  whether an acceleration sets the bound
    std::string of_step(double fixed, double bound, bool by_acceleration, std::uint64_t step, bool warns);
    /// Returns a warning if matter has reached a face of the domain, and not all faces have walls, if matter that bears
    /// tension is stretched farther than the kernel joins its particles (both are looked for every 32nd step only), or
    /// that of SlowStrain::look(); otherwise an empty string.
    /// \param now  before a step
    /// \param has_all_walls    whether every face of the domain has a wall. \see detail::has_all_walls
    /// \param tells_strain     whether the transfer is affine
    template <std::floating_point S, int D>
    std::string of_matter(SetList<S, D>& sets, const Domain<D>& domain, const KernelFacts& kernel, bool has_all_walls,
                          bool tells_strain, const Moment& now, int threads, const RanksOf<S, D>& ranks);
    /// Gives a warning if the samples of a new body are further apart than the cell size.
    /// \param warn  a function that receives the warning; may be empty
    /// \param speaks  whether this process gives warnings
    template <int D>
    void of_spacing(const Samples<D>& samples, const Domain<D>& domain, const Warn& warn, bool speaks);
    /// Gives a warning if an acceleration field takes the place of the simulation's gravity, and has none.
    /// \param speaks  whether this process gives warnings
    template <int D, class Acceleration>
    void of_gravity(const Acceleration& acceleration, const Vec<double, D>& gravity, const Warn& warn, bool speaks) {
        if (!warn || gravity_said_) return;
        const std::string text = lost_gravity(acceleration, gravity);
        gravity_said_ = !text.empty();
        if (!text.empty() && speaks) warn(text);
    }
    /// Gives a warning, for a policy that averages volume changes, if the plastic flow of a material changes the volume
    /// and its state does not tell by how much.
    /// \param speaks  whether this process gives warnings
    template <int D, class Material>
    void of_locking(const Material& material, const Warn& warn, bool speaks) {
        if constexpr (requires { material.dilates(); } && !tells_plastic_volume<material_state_t<Material, D>>) {
            if (!warn || locking_said_ || !material.dilates()) return;
            locking_said_ = true;
            if (speaks)
                warn(
                    "This material gains volume as it flows, and FBar gives the particles of a cell one volume change: "
                    "it locks, and bears many times its load. In explicit steps give firn::PlasticVolume<…> of it; "
                    "else leave out FBar.");
        }
    }
    /// Gives a warning if the velocities of rigid bodies were not found in a step.
    void of_bodies(bool found, const Warn& warn, bool speaks) {
        if (!warn || found || bodies_said_) return;
        bodies_said_ = true;
        if (speaks)
            warn(
                "The velocities of rigid bodies were not found to rounding in a step: friction leaves several, or a "
                "body is squeezed by solids through matter. Momenta are conserved all the same; energy may not be. "
                "Take shorter steps.");
    }
    /// Gives warnings before the first step: if positions have too few digits, if walls do not coincide with the faces
    /// of the domain or stand between planes of nodes, if particles lie inside solids of the boundary, if bodies
    /// overlap, or if solids are thin or cap their distances.
    /// \param has_groups  whether matter may be in contact groups
    /// \param ranks  what the processes of the run tell each other; one of them gives the warnings
    template <std::floating_point S, int D, class Boundary>
    void of_start(const SetList<S, D>& sets, const Domain<D>& domain, const Boundary& boundary, bool has_groups,
                  const Warn& warn, const RanksOf<S, D>& ranks);

private:
    [[gnu::cold]] std::string of_small_bound(double bound, std::uint64_t step, double time,
                                             const std::function<std::string()>& reason);

    double largest_ = 0, said_ratio_ = 1 / 1.2;
    SlowStrain slow_strain_;
    bool fallen_said_ = false, small_said_ = false, started_ = false, spacing_said_ = false, end_said_ = false,
         stretch_said_ = false, gravity_said_ = false, locking_said_ = false, bodies_said_ = false;
};

template <std::floating_point S, int D, class Boundary>
void Warnings::of_start(const SetList<S, D>& sets, const Domain<D>& domain, const Boundary& boundary, bool has_groups,
                        const Warn& warn, const RanksOf<S, D>& ranks) {
    if (!warn || started_) return;
    started_ = true;
    for (const std::string& here :
         {few_digits<S>(domain), other_walls(boundary, domain), walls_between_nodes(boundary, domain),
          matter_in_solids(sets, domain, boundary), overlapping_bodies(sets), thin_solids(boundary, domain, has_groups),
          capped_distances(boundary, domain)})
        if (const std::string text = ranks.text_of_first(here); !text.empty() && ranks.speaks()) warn(text);
}

}  // namespace firn::inline FIRN_BUILD::detail

#if FIRN_HAS_BODIES
#include <firn/simulation/warnings-inl.hpp>
#endif
