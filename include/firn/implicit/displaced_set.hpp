/// \file The particles of one set in a displacement of the nodes: their energy, their stresses, and the changes of
/// these along another displacement.
#pragma once

#include <firn/force/concept.hpp>
#include <firn/implicit/matrices.hpp>
#include <firn/implicit/response.hpp>
#include <firn/loops/gather.hpp>

#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// What a displacement of the nodes means for particles.
struct DisplacementReport {
    double energy = 0;         ///< Σ V0 ψ(F′) [J]; NaN if a material has no potential. \see has_potential
    std::size_t inverted = 0;  ///< Number of particles with det(I + ∇u) ≤ 0 or NaN: they exert no forces.
    std::size_t first = 0;     ///< Slot of the first of these particles in its set, if there are any.
    std::size_t set = 0;       ///< Index of the set of that particle.

    /// Whether no particle is inverted: only then forces and products mean anything.
    bool is_regular() const { return inverted == 0; }
};

/// The particles of one set in an implicit step, with the memory that it takes for each: 2 D² numbers.
/// \tparam Kernel, Force  the kernel and the force form, which define ∇u
template <class Kernel, class Force, class View, class Material>
class DisplacedSet {
public:
    using S = typename View::scalar_type;      ///< The scalar type: float or double.
    static constexpr int D = View::dimension;  ///< The dimension: 2 or 3.
    /// Whether the material has a potential: its share of the Hessian is then symmetric.
    static constexpr bool is_symmetric = has_potential<Material, D>;
    /// The view of the matrices that the particles scatter.
    using Matrices = MatrixView<S, D, decltype(View::position)>;

    static_assert(require_material<Material, D>() && require_kernel<Kernel>() && require_force<Force>());
    static_assert(detail::require_same_precision<Material, S>());

    /// Takes the particles as they are at the start of the step. What `set` refers to must exist as long as this
    /// object.
    DisplacedSet(const ParticleSet<View>& set, const Material& material)
        : set_(set), material_(lift<P>(material)), dual_(lift<dual<P>>(material)) {}

    const ParticleSet<View>& particles() const { return set_; }  ///< The particles at the start of the step.
    /// The matrices that scatter_matrices() takes: what the last call of displace() or differentiate() has left.
    ParticleSet<Matrices> matrices() const { return {{set_.view.position, span(matrices_)}, set_.partition}; }

    /// Displaces the nodes by u. Keeps ∇u of each particle, and the matrix V0 τ′ (I + ∇u)⁻ᵀ [J], whose sums over
    /// particles are the gradient of the potential.
    /// \param layer  the layer of the grid that holds u [m]
    /// \param dt     time of the step [s]; 1 where time has no meaning
    DisplacementReport displace(const SparseGrid<S, D>& grid, std::size_t layer, double dt, int threads) {
        const std::size_t numbers = set_.partition.slots() * std::size_t(D * D);
        if (gradients_.size() != numbers) {
            renew(gradients_, numbers, threads);
            renew(matrices_, numbers, threads);
        }
        const BlockedSpan<S> gradients = span(gradients_), matrices = span(matrices_);
        std::vector<GroupReport> reports(set_.partition.groups.size());
        for_registers(
            grid, layer, threads, [&](std::size_t g, const Slots& slots, const Mat<P, D>& gathered) FIRN_LAMBDA {
                const auto real = is_real(slots);
                const auto regular = volume_factor(gathered) > P(0);
                const Mat<P, D> gradient = select(real & regular, gathered, Mat<P, D>::zero());
                reports[g].see(slots, lane_bits(real & !regular));
                const P volume = select(real, set_.view.volume.template load_or_zero<P>(slots, 0), P(0));
                const auto after =
                    after_displacement(material_, load_state<State>(set_.view.state, slots), gradient, P(S(dt)));
                if constexpr (has_potential<Material, D>)
                    add_lanes(reports[g].energy, select(real, volume * energy_density(material_, after.state), P(0)));
                const Mat<P, D> piola = piola_of_step(gradient, after.stress) * volume;
                unroll<D * D>([&](auto k) FIRN_LAMBDA {
                    gradients.store(slots, k, gradient.m[k]);
                    matrices.store(slots, k, select(real & regular, piola.m[k], P(0)));
                });
            });
        return joined(reports);
    }

    /// Replaces the matrices by their derivatives along a change v of the displacement u of the last displace(), whose
    /// sums are the product of the potential's Hessian with v.
    /// \param layer  the layer of the grid that holds v [m];  \param dt  time of the step [s], as for displace()
    void differentiate(const SparseGrid<S, D>& grid, std::size_t layer, double dt, int threads) {
        const BlockedSpan<S> gradients = span(gradients_), matrices = span(matrices_);
        for_registers(grid, layer, threads, [&](std::size_t, const Slots& slots, const Mat<P, D>& change) FIRN_LAMBDA {
            const P volume = set_.view.volume.template load_or_zero<P>(slots, 0);
            const Mat<P, D> piola = change_of(slots, gradients, change, P(S(dt))) * volume;
            const auto real = is_real(slots);
            unroll<D * D>([&](auto k) FIRN_LAMBDA { matrices.store(slots, k, select(real, piola.m[k], P(0))); });
        });
    }

    /// Returns the derivatives of the matrices V0 τ′ (I + ∇u)⁻ᵀ by each element of ∇u, for one register of particles
    /// [J]: element k is that by the element m[k]. Call displace() first. \param dt  as for displace()
    FIRN_INLINE auto tangent(const Slots& slots, double dt) const {
        std::array<Mat<P, D>, std::size_t(D * D)> by;
        const BlockedSpan<S> gradients = span(gradients_);
        const P volume = set_.view.volume.template load_or_zero<P>(slots, 0);
        const auto real = is_real(slots);
        for (int k = 0; k < D * D; ++k) {
            Mat<P, D> unit = Mat<P, D>::zero();
            unit.m[k] = P(1);
            const Mat<P, D> piola = change_of(slots, gradients, unit, P(S(dt))) * volume;
            by[std::size_t(k)] = select(real, piola, Mat<P, D>::zero());
        }
        return by;
    }

private:
    using P = native_pack<S>;
    using Lifted = with_scalar_t<Material, P>;
    using State = material_state_t<Lifted, D>;

    /// The report of the particles of one group.
    struct GroupReport {
        double energy = 0;
        std::size_t inverted = 0, first = std::numeric_limits<std::size_t>::max();

        FIRN_INLINE void see(const Slots& slots, std::uint32_t lanes) {
            if (lanes == 0) [[likely]]
                return;
            inverted += std::size_t(std::popcount(lanes));
            first = std::min(first, slots.first + std::size_t(std::countr_zero(lanes)));
        }
    };
    /// Joins the reports of groups, in the order of groups, so that the sum has the same bits for any number of
    /// threads.
    static DisplacementReport joined(const std::vector<GroupReport>& reports) {
        ExactSum energy;
        DisplacementReport all;
        all.first = std::numeric_limits<std::size_t>::max();
        for (const GroupReport& one : reports) {
            energy.add(one.energy);
            all.inverted += one.inverted;
            all.first = std::min(all.first, one.first);
        }
        if (all.inverted == 0) all.first = 0;
        all.energy = has_potential<Material, D> ? energy.value() : std::numeric_limits<double>::quiet_NaN();
        return all;
    }
    FIRN_INLINE static void add_lanes(double& sum, const P& numbers) {
        for (int l = 0; l < scalar_traits<P>::lanes; ++l) sum += double(numbers[l]);
    }

    static BlockedSpan<S> span(const aligned_vector<S>& numbers) { return {const_cast<S*>(numbers.data()), D * D}; }
    FIRN_INLINE auto is_real(const Slots& slots) const {
        return set_.view.mass.template load_or_zero<P>(slots, 0) > P(0);
    }
    FIRN_INLINE Mat<P, D> change_of(const Slots& slots, const BlockedSpan<S>& gradients, const Mat<P, D>& change,
                                    const P& dt) const {
        Mat<P, D> gradient;
        unroll<D * D>([&](auto k) FIRN_LAMBDA { gradient.m[k] = gradients.template load<P>(slots, k); });
        return piola_change(dual_, load_state<State>(set_.view.state, slots), gradient, change, dt);
    }

    /// Gathers the gradient of a layer of displacements: calls take(group, slots, ∇u) for each register of particles,
    /// padding included.
    template <class Take>
    void for_registers(const SparseGrid<S, D>& grid, std::size_t layer, int threads, const Take& take) const {
        const Positions<View> positions(grid.domain());
        const P h = P(S(grid.domain().cell_size));
        parallel_for(set_.partition.groups.size(), threads, [&](std::size_t g, int) {
            const BlockGroup& group = set_.partition.groups[g];
            const GroupPlaces<View> places(set_.view, set_.partition, group, positions);
            detail::gather_to_group<Kernel, g2p_needs_moment<Kernel, Pic, Force>,
                                    g2p_needs_gradient<Kernel, Pic, Force>>(
                set_.partition, group, places, grid, layer,
                [&](std::size_t slot, const G2PSums<P, D>& sums, const Vec<P, D>& offset) FIRN_LAMBDA {
                    take(g, places.slots(slot), take_from_grid<Kernel, Pic, Force>(sums, offset, h).velocity_gradient);
                });
        });
    }

    ParticleSet<View> set_;
    Lifted material_;
    with_scalar_t<Material, dual<P>> dual_;
    aligned_vector<S> gradients_, matrices_;
};

}  // namespace firn::inline FIRN_BUILD
