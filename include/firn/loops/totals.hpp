/// \file Totals of a set of particles: mass, momenta, energies.
#pragma once

#include <firn/core/exact_sum.hpp>
#include <firn/core/parallel.hpp>
#include <firn/data/block_partition.hpp>
#include <firn/data/converted_state.hpp>
#include <firn/data/particles.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/loops/execution.hpp>
#include <firn/loops/surroundings.hpp>
#include <firn/math/rotor.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Sums over the particles of a set. The contribution of each particle is computed in double. The sums are exact and
/// are rounded once, so they have the same bits for any number of threads and ranks, and for any order of the particles
/// in memory. \see ExactSum. The symbols in the formulas are the mass m, velocity v, position x, initial volume V0,
/// affine field C and energy density ψ of a particle, the cell size h, and the kernel's constant inverse_inertia.
template <int D>
struct Totals {
    std::size_t particles = 0;            ///< number of particles
    double mass = 0;                      ///< Σ m [kg]
    Vec<double, D> momentum{};            ///< Σ m v [kg m/s]
    Axial<double, D> angular_momentum{};  ///< Σ m x × v, plus the share of the affine fields C [kg m²/s]
    Vec<double, D> first_moment{};        ///< Σ m x [kg m]; divided by `mass`, the centre of mass
    double kinetic_energy = 0;            ///< Σ ½ m (|v|² + h²/inverse_inertia ‖C‖²) [J]
    double elastic_energy = 0;  ///< Σ V0 ψ [J]; NaN if the material has no energy_density, or one that depends on time
    double dissipated_energy = 0;  ///< Σ V0 × work of plastic flow [J]; 0 unless the material is `Dissipating<…>`

    /// Adds the totals `other` of another set of particles.
    Totals& operator+=(const Totals& other) {
        particles += other.particles;
        mass += other.mass;
        momentum += other.momentum;
        angular_momentum = angular_momentum + other.angular_momentum;
        first_moment += other.first_moment;
        kinetic_energy += other.kinetic_energy;
        elastic_energy += other.elastic_energy;
        dissipated_energy += other.dissipated_energy;
        return *this;
    }
};

namespace detail {

/// Returns the curl of a velocity field with the gradient C, which is twice the angular velocity of the field.
template <int D>
Axial<double, D> curl(const Mat<double, D>& C) {
    if constexpr (D == 2)
        return C(1, 0) - C(0, 1);
    else
        return {{C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1)}};
}

/// Calls f(q) for each number q of a particle's or a set's totals, except the number of particles.
template <class Of, class F>
FIRN_INLINE void for_quantities(Of& totals, const F& f) {
    constexpr int D = int(std::extent_v<decltype(totals.momentum.v)>);
    f(totals.mass);
    for (int a = 0; a < D; ++a) f(totals.momentum[a]);
    if constexpr (D == 2)
        f(totals.angular_momentum);
    else
        for (int a = 0; a < D; ++a) f(totals.angular_momentum[a]);
    for (int a = 0; a < D; ++a) f(totals.first_moment[a]);
    f(totals.kinetic_energy);
    f(totals.elastic_energy);
    f(totals.dissipated_energy);
}

/// Returns the totals of one particle.
/// \param material  the constitutive model in double
/// \param inertia   inertia of an affine field, per mass [m²]
template <class Material, std::floating_point S, int D, class State>
FIRN_INLINE Totals<D> totals_of_particle(const Particles<S, D, State>& particles, std::size_t slot,
                                         const Material& material, double inertia) {
    const double mass = double(particles.mass(slot)), volume = double(particles.volume(slot));
    const Vec<double, D> x = particles.exact_position(slot), v = cast<double>(particles.velocity(slot));
    const Mat<double, D> C = cast<double>(particles.affine(slot));
    const auto state = converted_state<material_state_t<Material, D>>(particles.state(slot));
    [[maybe_unused]] const auto here = [&] {  // the time is not known
        return surroundings_of_particle<double>(particles, slot, std::numeric_limits<double>::quiet_NaN());
    };
    Totals<D> one;
    one.particles = 1;
    one.mass = mass;
    one.momentum = v * mass;
    one.angular_momentum = (axial_product<double, D>(x, v) + curl<D>(C) * inertia) * mass;
    one.first_moment = x * mass;
    one.kinetic_energy = 0.5 * mass * (dot(v, v) + inertia * squared_norm(C));
    if constexpr (has_energy_density<Material, D>)
        one.elastic_energy = volume * energy_density(placed<D>(material, here), state);
    else
        one.elastic_energy = std::numeric_limits<double>::quiet_NaN();
    if constexpr (requires { state.dissipated; }) one.dissipated_energy = volume * state.dissipated;
    return one;
}

/// Adds the shares of the affine field C to the totals `one` of a particle, for a kernel whose inertia depends on the
/// particle's position. \see has_local_inertia
template <class Kernel, std::floating_point S, int D, class State>
FIRN_INLINE void add_affine(Totals<D>& one, const Particles<S, D, State>& particles, std::size_t slot,
                            const Domain<D>& domain) {
    const Vec<double, D> x = particles.exact_position(slot);
    const Mat<double, D> C = cast<double>(particles.affine(slot));
    Mat<double, D> C_times_inertia = C;
    double energy = 0;
    for (int j = 0; j < D; ++j) {
        const double place = (x[j] - domain.lower[j]) / domain.cell_size;
        const double d = place - base_node<Kernel>(place) - centre_node<Kernel>;
        const double inertia = Kernel::inertia(d) * domain.cell_size * domain.cell_size;
        for (int i = 0; i < D; ++i) {
            energy += C(i, j) * C(i, j) * inertia;
            C_times_inertia(i, j) = C(i, j) * inertia;
        }
    }
    one.angular_momentum = one.angular_momentum + curl<D>(C_times_inertia) * one.mass;
    one.kinetic_energy += 0.5 * one.mass * energy;
}

/// The exact sums from which the totals of a set are rounded. The sums of several sets, or of the shares of several
/// ranks, may be added before they are rounded.
template <int D>
struct TotalsSums {
    static constexpr std::size_t quantities = 4 + 2 * D + (D == 2 ? 1 : D);

    std::array<ExactSum, 1 + quantities> sums{};  ///< the number of particles, then the order of for_quantities()

    TotalsSums& operator+=(const TotalsSums& other) {
        for (std::size_t q = 0; q < sums.size(); ++q) sums[q] += other.sums[q];
        return *this;
    }
    /// Returns the totals, rounded.
    Totals<D> totals() const {
        Totals<D> rounded;
        rounded.particles = std::size_t(sums[0].value());
        std::size_t q = 0;
        for_quantities(rounded, [&](double& quantity) { quantity = sums[++q].value(); });
        return rounded;
    }
};

/// Returns the sums over all particles of a set. \see firn::totals
template <class Kernel, class Material, std::floating_point S, int D, class State>
TotalsSums<D> sum_totals(const Particles<S, D, State>& particles, const Domain<D>& domain, const Material& material,
                         int threads) {
    double inertia = 0;
    if constexpr (has_inertia<Kernel>) inertia = domain.cell_size * domain.cell_size / Kernel::inverse_inertia;
    const auto exact = lift<double>(material);

    constexpr std::size_t chunk = 256;
    struct Share {
        TotalsSums<D> of;
        /// A row for each quantity. A power of two between two rows would put them into the same lines of the cache.
        std::array<std::array<double, chunk + 8>, TotalsSums<D>::quantities> rows;
    };
    const std::size_t chunks = (particles.slots() + chunk - 1) / chunk;
    const int workers = thread_count(threads);
    std::vector<std::unique_ptr<Share>> shares{std::size_t(workers)};
    parallel_for(chunks, workers, [&](std::size_t c, int worker) {
        if (!shares[std::size_t(worker)]) shares[std::size_t(worker)].reset(new Share);
        Share& share = *shares[std::size_t(worker)];
        std::size_t count = 0;
        const std::size_t end = std::min(particles.slots(), (c + 1) * chunk);
        for (std::size_t slot = c * chunk; slot < end; ++slot) {
            if (!particles.is_particle(slot)) continue;
            Totals<D> one = totals_of_particle(particles, slot, exact, inertia);
            if constexpr (has_local_inertia<Kernel>) add_affine<Kernel>(one, particles, slot, domain);
            std::size_t q = 0;
            for_quantities(one, [&](double quantity) FIRN_LAMBDA { share.rows[q++][count] = quantity; });
            ++count;
        }
        share.of.sums[0].add(double(count));
        for (std::size_t q = 0; q < share.rows.size(); ++q)
            share.of.sums[q + 1].add(std::span(share.rows[q]).first(count));
    });
    TotalsSums<D> sum;
    for (const auto& share : shares)
        if (share) sum += share->of;
    return sum;
}

/// Returns the totals of the particles that all ranks of an execution hold together.
template <class Kernel, class Execution, class Material, std::floating_point S, int D, class State>
Totals<D> totals_of_ranks(const Execution& execution, const Particles<S, D, State>& particles, const Domain<D>& domain,
                          const Material& material) {
    TotalsSums<D> sums = sum_totals<Kernel>(particles, domain, material, requested_threads(execution));
    ranks_of(execution).merge(sums.sums);
    return sums.totals();
}

}  // namespace detail

/// Returns the totals of a set of particles.
///
/// An affine field C has angular momentum and kinetic energy, like a body whose inertia per mass is h²/inverse_inertia
/// (Jiang, Schroeder and Teran 2017). If the kernel's inertia depends on the position of a particle, the inertia at the
/// particle's present position counts; with the linear kernel, affine fields do not contribute to the totals.
/// \param threads  number of threads; 0: thread_count() chooses it
template <class Kernel, class Material, std::floating_point S, int D, class State>
Totals<D> totals(const Particles<S, D, State>& particles, const Domain<D>& domain, const Material& material,
                 int threads = 0) {
    return detail::sum_totals<Kernel>(particles, domain, material, threads).totals();
}

}  // namespace firn::inline FIRN_BUILD
