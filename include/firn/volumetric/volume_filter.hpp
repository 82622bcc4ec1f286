/// \file A filter of the volume ratios against noise of the pressure, with particle shifting against loss of volume.
#pragma once

#include <firn/core/error.hpp>
#include <firn/core/parameters.hpp>
#include <firn/core/scalar.hpp>
#include <firn/volumetric/concept.hpp>

#include <cmath>

namespace firn::inline FIRN_BUILD {

/// A filter that removes from the volume ratios J of the particles what no node feels, so that the pressure stays
/// smooth; and that keeps particles as far apart as their volumes ask for, so that liquids fill their volume after a
/// splash. Use VolumeFilter for every liquid that splashes, and for soft solids that flow or rest for a long time.
///
/// There are more particles than nodes. So many patterns of J over the particles of one cell cause almost no force on
/// any node (null modes): nothing drives them back, and they grow while particles move. Every few steps, the filter
/// lets them decay:
///
///     J ← J − b (1 − A)² J,        b = x/(1 + x),        x = rate · every · dt c/h
///     (A J)_p = Σ_i N_ip J_i,      J_i = Σ_p N_ip V0_p J_p / Σ_p N_ip V0_p
///
/// N_ip is the weight of particle p at node i, V0_p its initial volume, h the cell size, c the largest signal speed.
/// The average A is taken among the particles of one set (one material). A particle without elastic stress, such as a
/// drop of spray with J > 1, takes no part. A material that stores a deformation gradient F has J = det F, and F is
/// scaled; then the return mapping of the material follows.
///
/// A has eigenvalues from 0 to 1. So the filter never increases Σ V0 J², and it keeps the volume Σ V0 J. A pattern of
/// wave number k decays by the share b (kh)⁴/16 in one pass: waves that the grid resolves and the slope of a
/// hydrostatic pressure are left as they are. A plain average (1 − A in place of its square) flattens the pressure
/// below a free surface. The filter does not repair what walls do: use it with mirrored walls. \see NodesBehind
///
/// Particle shifting. J of a particle is integrated, and nothing compares it with the density around the particle. A
/// flow brings particles together between nodes, where no node feels it: after a dam break, 20 s of water with 2 × 2
/// particles a cell lose 44 % of their depth. So materials that store J itself, such as Fluid, have their particles
/// moved off overfull nodes in each pass of the filter:
///
///     r_i = ∫ N_i dV / h^D over the room,       e_i = max(0, Σ_p N_ip V0_p J_p / (r_i h^D) − 1)
///     x_p ← x_p − ½ s h² Σ_i r_i (e_i − ē_p) ∇N_ip,      s = y/(1 + y),      y = shifting · every · dt c/h
///
/// ē_p is Σ N r e / Σ N r of the particle. The room is the domain without what lies behind walls and in colliders; of a
/// collider's layer, the outer half of a cell counts as room, since there matter comes to rest. Particles of all sets
/// fill nodes, those of other materials and other contact groups, too. A particle goes at most a quarter of a cell
/// along each axis, and half of the way to a wall or a solid; none is moved out of the domain, into a solid, or deeper
/// into one. A boundary of your own without surfaces() bounds no room. \see has_surfaces
///
/// v, C and J stay, so momentum is kept. Angular momentum changes (by 0.1 % when two drops collide), and particles that
/// are moved up gain potential energy. Water in a lattice that fills its room is not moved. With `shifting` = 0.07, the
/// depth after 20 s is right within 3 % (walls that hold nodes or mirror, 2 × 2 or 4 × 4 particles a cell, h = 1/32 m,
/// K = 100 kPa). Between walls that hold nodes, still water with h = 1/64 m loses 8 %; with mirrored walls 1 %, with
/// `shifting` = 1 2 to 4 %. Waves last longer where no volume is lost. With WeightGradientForce, shifting brings noise
/// to still water: the pressure beside mirrored walls scatters by 2.7 % of ρ g H after 4 s, and by 0.3 % with
/// `shifting` = 0.
///
/// A step costs 1.13 times as much with the default interval, and 1.22 times for materials that store J.
///
/// Other filters of null modes: Gritton and Berzins 2017, "Improving accuracy in the MPM method using a null space
/// filter"; Tran and Sołowski 2019, "Temporal and null-space filter for the material point method". Particle shifting:
/// Xu, Stansby and Laurence 2009, "Accuracy and stability in incompressible SPH (ISPH) based on the projection method
/// and a new approach"; Lind et al. 2012, "Incompressible smoothed particle hydrodynamics for free-surface flows". In
/// particle-in-cell methods: Kugelstadt et al. 2019, "Implicit density projection for volume conserving liquids".
struct VolumeFilter {
    static constexpr const char* name = "volume_filter";
    static constexpr bool averages_volume = false;  ///< Rates of volume change are not averaged.

    int every = 8;    ///< number of steps from one pass of the filter to the next, 1 or more [1]
    double rate = 1;  ///< rate of the decay of null modes, per time h/c in which sound crosses a cell [1]
    /// rate at which overfull nodes lose their excess volume by particle shifting, per time h/c [1]; 0: particles are
    /// not shifted
    double shifting = 0.07;

    /// Checks the parameters.
    /// \throws parameter_error  if `every` is less than 1, or `rate` is negative or not finite
    void check() const {
        if (every < 1)
            throw parameter_error(sentence("The filter of volume ratios is to act every ", every,
                                           " steps; give 1 or more. To leave it out, choose the policy OwnVolume."));
        if (!(rate >= 0) || !std::isfinite(rate))
            throw parameter_error(
                sentence("The rate of the filter of volume ratios is ", rate, "; it must be finite and not negative."));
        if (!(shifting >= 0) || !std::isfinite(shifting))
            throw parameter_error(
                sentence("The rate of particle shifting is ", shifting, "; it must be finite and not negative."));
    }
    static constexpr auto parameters() {
        return std::tuple{parameter{"every", "1", &VolumeFilter::every}, parameter{"rate", "1", &VolumeFilter::rate},
                          parameter{"shifting", "1", &VolumeFilter::shifting}};
    }

    /// Returns whether a pass of the filter belongs to the step after `steps` steps.
    bool is_due(std::uint64_t steps) const { return (steps + 1) % std::uint64_t(every) == 0; }
    /// Returns the share b of the null modes that one pass removes [1].
    /// \param crossed  dt c/h: the way of sound in one step [cells]
    template <scalar S>
    S share(const S& crossed) const {
        return share_of(rate, crossed);
    }
    /// Returns the share s of the excess volumes that one pass of particle shifting removes [1].
    /// \param crossed  dt c/h: the way of sound in one step [cells]
    template <scalar S>
    S shifted_share(const S& crossed) const {
        return share_of(shifting, crossed);
    }

private:
    template <scalar S>
    S share_of(double per_crossing, const S& crossed) const {
        const S x = S(per_crossing * every) * crossed;
        return x / (S(1) + x);
    }
};

static_assert(volumetric<VolumeFilter> && filters_volume<VolumeFilter> && shifts_particles<VolumeFilter>);

}  // namespace firn::inline FIRN_BUILD
