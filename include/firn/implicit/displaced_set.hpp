/// \file The particles of one set in a displacement of the nodes: their energy, their stresses, and the changes of
/// these along another displacement.
#pragma once

#include <firn/force/concept.hpp>
#include <firn/implicit/matrices.hpp>
#include <firn/implicit/response.hpp>
#include <firn/loops/gather.hpp>
#include <firn/loops/surroundings.hpp>
#include <firn/loops/volume_passes.hpp>

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

/// The particles of one set in an implicit step, with the memory that it takes for each: 2 D² numbers, and two more if
/// rates of volume change are averaged.
///
/// With FBarOfStep, the volume change that strains a particle's matter is the average of those around it. Forces on
/// nodes are not averaged, as in explicit steps. So matter has no potential then: its Hessian is symmetric for small
/// strains and moduli that are the same for all particles, but not in general.
/// \tparam Kernel, Force  the kernel and the force form, which define ∇u
/// \tparam Volume         the volumetric policy: OwnVolume or FBarOfStep
template <class Kernel, class Force, class View, class Material, volumetric Volume = OwnVolume>
class DisplacedSet {
public:
    using S = typename View::scalar_type;      ///< The scalar type: float or double.
    static constexpr int D = View::dimension;  ///< The dimension: 2 or 3.
    /// Whether the material has a potential: its share of the Hessian is then symmetric.
    static constexpr bool is_symmetric = has_potential<Material, D> && !Volume::averages_volume;
    /// The view of the matrices that the particles scatter.
    using Matrices = MatrixView<S, D, decltype(View::position)>;

    static_assert(require_material<Material, D>() && require_kernel<Kernel>() && require_force<Force>());
    static_assert(detail::require_same_precision<Material, S>());
    static_assert(
        !Volume::averages_volume || !tells_plastic_volume<material_state_t<Material, D>>,
        "firn: implicit and quasi-static steps do not take PlasticVolume with FBar; give the model itself, or "
        "take explicit steps.");

    /// Takes the particles as they are at the start of the step. What `set` refers to must exist as long as this
    /// object.
    /// \param mirrors  the mirrored walls of the grid, beside which averages are mirrored, too
    /// \param domain, time  for a material that asks for surroundings; time of the start of the step [s]
    DisplacedSet(const ParticleSet<View>& set, const Material& material, const Mirrors& mirrors = {},
                 const Domain<D>& domain = {}, double time = 0)
        : set_(set),
          material_(lift<P>(material)),
          dual_(lift<dual<P>>(material)),
          mirrors_(mirrors),
          around_(set_.view, set_.partition, domain, time) {}

    const ParticleSet<View>& particles() const { return set_; }  ///< The particles at the start of the step.
    /// The matrices that scatter_matrices() takes: what the last call of displace() or differentiate() has left.
    ParticleSet<Matrices> matrices() const { return {{set_.view.position, span(matrices_)}, set_.partition}; }

    /// Displaces the nodes by u. Keeps ∇u of each particle, and the matrix V0 τ′ (I + ∇u)⁻ᵀ [J], whose sums over
    /// particles are the gradient of the potential. The present numbers of the nodes may be overwritten.
    /// \param layer  the layer of the grid that holds u [m]
    /// \param dt     time of the step [s]; 1 where time has no meaning
    DisplacementReport displace(SparseGrid<S, D>& grid, std::size_t layer, double dt, int threads) {
        const std::size_t count = set_.partition.slots(), numbers = count * std::size_t(D * D);
        if (gradients_.size() != numbers) {
            renew(gradients_, numbers, threads);
            renew(matrices_, numbers, threads);
            if (Volume::averages_volume) renew(averages_, count, threads);
        }
        const BlockedSpan<S> gradients = span(gradients_), matrices = span(matrices_), averages = span(averages_, 1);
        std::vector<GroupReport> reports(set_.partition.groups.size());
        const auto change_of_volume = [](const Slots&, const Mat<P, D>& own)
                                          FIRN_LAMBDA { return rate_to_average<Volume>(own, P(1)); };
        const auto strain = [&](std::size_t g, const Slots& slots, const Mat<P, D>& gathered,
                                const P& average) FIRN_LAMBDA {
            const auto real = is_real(slots);
            auto regular = volume_factor(gathered) > P(0);
            if constexpr (Volume::averages_volume) regular = regular & (average > P(-1));
            reports[g].see(slots, lane_bits(real & !regular));
            const Mat<P, D> own = select(real & regular, gathered, Mat<P, D>::zero());
            const P around = select(real & regular, average, P(0));
            const P volume = select(real, set_.view.volume.template load_or_zero<P>(slots, 0), P(0));
            const auto& material = detail::placed_in<D>(material_, around_, slots);
            const auto after = after_displacement(material, load_state<State>(set_.view.state, slots),
                                                  of_matter(own, around), P(S(dt)));
            if constexpr (has_potential<Material, D>)
                add_lanes(reports[g].energy, select(real, volume * energy_density(material, after.state), P(0)));
            const Mat<P, D> piola = piola_of_step(own, after.stress) * volume;
            unroll<D * D>([&](auto k) FIRN_LAMBDA {
                gradients.store(slots, k, own.m[k]);
                matrices.store(slots, k, select(real & regular, piola.m[k], P(0)));
            });
            if constexpr (Volume::averages_volume) averages.store(slots, 0, around);
        };
        for_gradients(grid, layer, threads, gradients, change_of_volume, strain);
        return joined(reports);
    }

    /// Replaces the matrices by their derivatives along a change v of the displacement u of the last displace(), whose
    /// sums are the product of the potential's Hessian with v. The present numbers of the nodes may be overwritten.
    /// \param layer  the layer of the grid that holds v [m];  \param dt  time of the step [s], as for displace()
    void differentiate(SparseGrid<S, D>& grid, std::size_t layer, double dt, int threads) {
        const BlockedSpan<S> matrices = span(matrices_);
        const auto change_of_volume = [&](const Slots& slots, const Mat<P, D>& change) FIRN_LAMBDA {
            return rate_to_average<Volume>(along(slots, change), dual<P>(P(1))).derivative;
        };
        for_gradients(
            grid, layer, threads, matrices, change_of_volume,
            [&](std::size_t, const Slots& slots, const Mat<P, D>& change, const P& average) FIRN_LAMBDA {
                const P volume = set_.view.volume.template load_or_zero<P>(slots, 0);
                const Mat<P, D> piola = change_of(slots, along(slots, change), average, P(S(dt))) * volume;
                const auto real = is_real(slots);
                unroll<D * D>([&](auto k) FIRN_LAMBDA { matrices.store(slots, k, select(real, piola.m[k], P(0))); });
            });
    }

    /// Returns the derivatives of the matrices V0 τ′ (I + ∇u)⁻ᵀ by each element of ∇u, for one register of particles
    /// [J]: element k is that by the element m[k]. The average of FBarOfStep changes as the particle's own volume does.
    /// Call displace() first. \param dt  as for displace()
    FIRN_INLINE auto tangent(const Slots& slots, double dt) const {
        std::array<Mat<P, D>, std::size_t(D * D)> by;
        const P volume = set_.view.volume.template load_or_zero<P>(slots, 0);
        const auto real = is_real(slots);
        for (int k = 0; k < D * D; ++k) {
            Mat<P, D> unit = Mat<P, D>::zero();
            unit.m[k] = P(1);
            const auto own = along(slots, unit);
            P average(0);
            if constexpr (Volume::averages_volume) average = rate_to_average<Volume>(own, dual<P>(P(1))).derivative;
            const Mat<P, D> piola = change_of(slots, own, average, P(S(dt))) * volume;
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

    static BlockedSpan<S> span(const aligned_vector<S>& numbers, int width = D * D) {
        return {const_cast<S*>(numbers.data()), width};
    }
    FIRN_INLINE auto is_real(const Slots& slots) const {
        return set_.view.mass.template load_or_zero<P>(slots, 0) > P(0);
    }
    /// Returns ∇u that strains the matter of particles. \param own  their ∇u;  \param average  that of FBarOfStep
    template <class T>
    FIRN_INLINE static Mat<T, D> of_matter(const Mat<T, D>& own, [[maybe_unused]] const T& average) {
        if constexpr (Volume::averages_volume)
            return averaged_gradient<Volume>(own, average, T(P(1)));
        else
            return own;
    }
    /// Returns ∇u at the displacement, with a change of it.
    FIRN_INLINE Mat<dual<P>, D> along(const Slots& slots, const Mat<P, D>& change) const {
        const BlockedSpan<S> gradients = span(gradients_);
        Mat<dual<P>, D> both;
        unroll<D * D>([&](auto k)
                          FIRN_LAMBDA { both.m[k] = dual<P>{gradients.template load<P>(slots, k), change.m[k]}; });
        return both;
    }
    FIRN_INLINE Mat<P, D> change_of(const Slots& slots, const Mat<dual<P>, D>& own,
                                    [[maybe_unused]] const P& change_of_average, const P& dt) const {
        dual<P> average(P(0));
        if constexpr (Volume::averages_volume)
            average = dual<P>{span(averages_, 1).template load<P>(slots, 0), change_of_average};
        return piola_change(detail::placed_in<D>(dual_, around_, slots), load_state<State>(set_.view.state, slots), own,
                            of_matter(own, average), dt);
    }

    /// Gathers the gradient of a layer of displacements: calls take(group, slots, ∇u, average) for each register of
    /// particles, padding included. The average is 0 if nothing is averaged.
    /// \param memory  for D × D numbers of each slot; take() may overwrite those of its slots
    /// \param rate    rate(slots, ∇u) is what is averaged
    template <class Rate, class Take>
    void for_gradients(SparseGrid<S, D>& grid, std::size_t layer, int threads,
                       [[maybe_unused]] const BlockedSpan<S>& memory, [[maybe_unused]] const Rate& rate,
                       const Take& take) {
        constexpr bool moments = g2p_needs_moment<Kernel, Pic, Force>, slopes = g2p_needs_gradient<Kernel, Pic, Force>;
        const P h = P(S(grid.domain().cell_size));
        const auto gradient_of = [&](const auto& sums, const auto& offset) FIRN_LAMBDA {
            return take_from_grid<Kernel, Pic, Force>(sums, offset, h).velocity_gradient;
        };
        if constexpr (!Volume::averages_volume) {
            gather<moments, slopes>(grid, layer, threads,
                                    [&](std::size_t g, const Slots& slots, const auto& sums, const auto& offset)
                                        FIRN_LAMBDA { take(g, slots, gradient_of(sums, offset), P(0)); });
        } else {
            const auto rates = detail::numbers_like(set_.view, rates_, set_.partition.slots(), threads);
            gather<moments, slopes>(
                grid, layer, threads,
                [&](std::size_t, const Slots& slots, const auto& sums, const auto& offset) FIRN_LAMBDA {
                    const Mat<P, D> gradient = gradient_of(sums, offset);
                    unroll<D * D>([&](auto k) FIRN_LAMBDA { memory.store(slots, k, gradient.m[k]); });
                    rates.store(slots, 0, select(is_real(slots), rate(slots, gradient), P(0)));
                });
            const std::array all{ParticleSet<detail::RateView<View>>{
                {set_.view.position, set_.view.volume, rates, false}, set_.partition}};
            std::optional<FixedPointScale<S>> scale;
            detail::average_at_nodes<Kernel>(Coloured{threads}, grid, mirrors_, scale, threads,
                                             ParticleSets<detail::RateView<View>>(all));
            gather<false, false>(
                grid, 0, threads, [&](std::size_t g, const Slots& slots, const auto& sums, const auto&) FIRN_LAMBDA {
                    Mat<P, D> gradient;
                    unroll<D * D>([&](auto k) FIRN_LAMBDA { gradient.m[k] = memory.template load<P>(slots, k); });
                    take(g, slots, gradient, sums.velocity.v[0]);
                });
        }
    }
    /// Gathers a layer: calls take(group, slots, sums, offset) for each register of particles, padding included.
    /// \tparam moments, slopes  which sums are needed. \see PackSums
    template <bool moments, bool slopes, class Take>
    void gather(const SparseGrid<S, D>& grid, std::size_t layer, int threads, const Take& take) const {
        const Positions<View> positions(grid.domain());
        parallel_for(set_.partition.groups.size(), threads, [&](std::size_t g, int) {
            const BlockGroup& group = set_.partition.groups[g];
            const GroupPlaces<View> places(set_.view, set_.partition, group, positions);
            detail::gather_to_group<Kernel, moments, slopes>(
                set_.partition, group, places, grid, layer,
                [&](std::size_t slot, const G2PSums<P, D>& sums, const Vec<P, D>& offset)
                    FIRN_LAMBDA { take(g, places.slots(slot), sums, offset); });
        });
    }

    ParticleSet<View> set_;
    Lifted material_;
    with_scalar_t<Material, dual<P>> dual_;
    Mirrors mirrors_;
    [[no_unique_address]] detail::surroundings_for<Material, View> around_;
    aligned_vector<S> gradients_, matrices_;
    aligned_vector<S> rates_, averages_;  // of FBarOfStep: what is averaged, and the average at the displacement
};

}  // namespace firn::inline FIRN_BUILD
