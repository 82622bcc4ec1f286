/// \file The incremental potential of all particles on a grid, as a function of the displacements of the nodes in one
/// step: its value, its gradient, and the product of its Hessian with a vector, without a matrix.
///
///     Π(u) = Σ V0 ψ(F′),        F′ = (I + Σ uᵢ ⊗ wᵢ) F
///
/// F is the deformation gradient of a particle at the start of the step, wᵢ = ∇Nᵢ (WeightGradientForce) or
/// Nᵢ D⁻¹ (xᵢ − xₚ) (MlsForce). The weights are those at the start of the step, so Π is exact for displacements of any
/// size. Matter without a potential, such as plastic matter, has the gradient and its derivative alone.
#pragma once

#include <firn/implicit/displaced_set.hpp>

#include <array>
#include <tuple>

namespace firn::inline FIRN_BUILD {

/// The incremental potential of the particles of all sets on a grid, at one displacement of the nodes. All results have
/// the same bits for any number of threads.
///
/// Vectors of the nodes are layers of the grid, and results are its present numbers: of each node the first D numbers
/// count, the others are zero.
///
///     IncrementalPotential potential(grid, dt, threads, DisplacedSet<Kernel, Force, View, Material>(set, material));
///     if (potential.displace(layer_of_u).is_regular()) potential.gradient();   // grid.nodes(0): ∂Π/∂u
///     potential.product(layer_of_v);                                           // grid.nodes(0): (∂²Π/∂u²) v
/// \tparam Sets  DisplacedSets with one kernel and force form
template <class Kernel, class Force, std::floating_point S, int D, class... Sets>
class IncrementalPotential {
public:
    using kernel_type = Kernel;          ///< The kernel.
    using scalar_type = S;               ///< The scalar type: float or double.
    static constexpr int dimension = D;  ///< The dimension: 2 or 3.
    /// Whether all materials have a potential: the Hessian is then symmetric.
    static constexpr bool is_symmetric = (Sets::is_symmetric && ...);

    /// Makes the potential of some sets. The grid must be active for all of them, and exist as long as the potential.
    /// \param dt       time of the step [s]; 1 where time has no meaning
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws parameter_error  if dt is not positive and finite
    IncrementalPotential(SparseGrid<S, D>& grid, double dt, int threads, Sets... sets)
        : grid_(grid), threads_(threads), sets_(std::move(sets)...) {
        set_dt(dt);
    }
    /// Sets the time of the step [s]; displace() comes next.
    /// \throws parameter_error  if it is not positive and finite
    void set_dt(double dt) {
        if (!(dt > 0)) throw parameter_error(sentence("An implicit step takes ", dt, " s; it must be positive."));
        detail::check_step(dt);
        dt_ = dt;
        is_displaced_ = holds_stresses_ = false;
    }

    /// Displaces the nodes by the vector in a layer [m]. gradient() and product() are then those at this displacement.
    /// \throws usage_error  if the grid has no such layer, or is not active for the particles
    DisplacementReport displace(std::size_t layer) {
        require(layer);
        DisplacementReport all;
        with_workers([&](int workers) {
            std::size_t index = 0;
            for_sets([&](auto& set) {
                const DisplacementReport one = set.displace(grid_, layer, dt_, workers);
                if (all.inverted == 0 && one.inverted > 0) {
                    all.first = one.first;
                    all.set = index;
                }
                all.energy += one.energy;
                all.inverted += one.inverted;
                ++index;
            });
        });
        holds_stresses_ = is_displaced_ = true;
        return all;
    }
    /// Sets the present numbers of the nodes to the gradient of the potential [N]: the forces of particles, negative.
    /// \throws usage_error  if displace() was not called; or if product() was called since
    void gradient() {
        if (!holds_stresses_)
            throw usage_error("The gradient of a potential follows displace(), before any product().");
        scatter();
    }
    /// Sets the present numbers of the nodes to the Hessian of the potential, times the vector v in a layer. The unit
    /// is that of v times N/m. The Hessian is symmetric if all materials have a potential.
    /// \throws usage_error  if displace() was not called, or if the grid has no such layer
    void product(std::size_t layer) {
        require(layer);
        if (!is_displaced_) throw usage_error("A product with the Hessian of a potential follows displace().");
        holds_stresses_ = false;
        with_workers([&](int workers) { for_sets([&](auto& set) { set.differentiate(grid_, layer, dt_, workers); }); });
        scatter();
    }

    SparseGrid<S, D>& grid() const { return grid_; }           ///< The grid whose nodes are displaced.
    double dt() const { return dt_; }                          ///< Time of the step [s].
    int threads() const { return threads_; }                   ///< Number of threads that was asked for.
    const std::tuple<Sets...>& sets() const { return sets_; }  ///< The sets of particles.

private:
    template <class F>
    void for_sets(const F& f) {
        std::apply([&](auto&... set) { (f(set), ...); }, sets_);
    }
    template <class F>
    void with_workers(const F& f) {
        const int workers = thread_count(threads_);
        parallel_region(workers, [&] { f(workers); });
    }
    void scatter() {
        std::apply(
            [&](const auto&... set) {
                const std::array all{set.matrices()...};
                using View = std::remove_cvref_t<decltype(all[0].view)>;
                scatter_matrices<Kernel, Force>(grid_, threads_, ParticleSets<View>(all));
            },
            sets_);
    }
    void require(std::size_t layer) {
        if (layer == 0 || (grid_.block_count() > 0 && !grid_.layer(layer)))
            throw usage_error(sentence("The vector of an implicit step is layer ", layer,
                                       " of the grid, which is not there. Call exchange() with it first."));
        for_sets([&](const auto& set) { grid_.require_active(set.particles().partition); });
    }

    SparseGrid<S, D>& grid_;
    double dt_ = 1;
    int threads_;
    std::tuple<Sets...> sets_;
    bool is_displaced_ = false, holds_stresses_ = false;
};
/// Takes kernel and force form from the sets.
template <std::floating_point S, int D, class Kernel, class Force, class Volume, class... Views, class... Materials>
IncrementalPotential(SparseGrid<S, D>&, double, int, DisplacedSet<Kernel, Force, Views, Materials, Volume>...)
    -> IncrementalPotential<Kernel, Force, S, D, DisplacedSet<Kernel, Force, Views, Materials, Volume>...>;

}  // namespace firn::inline FIRN_BUILD
