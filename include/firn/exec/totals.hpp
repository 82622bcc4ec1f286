/// \file Totals of a set of particles: mass, momenta, energies.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/particles.hpp>
#include <firn/kernel/concept.hpp>
#include <firn/material/concept.hpp>
#include <firn/math/rotor.hpp>

#include <limits>
#include <vector>

namespace firn {

/// Sums over the particles of a set, in double. The symbols in the formulas are the mass m, velocity v, position x,
/// initial volume V0, affine field C and energy density ψ of a particle, the cell size h, and the kernel's constant
/// inverse_inertia.
template <int D>
struct Totals {
    std::size_t particles = 0;            ///< number of particles
    double mass = 0;                      ///< Σ m [kg]
    Vec<double, D> momentum{};            ///< Σ m v [kg m/s]
    Axial<double, D> angular_momentum{};  ///< Σ m x × v, plus the share of the affine fields C [kg m²/s]
    Vec<double, D> first_moment{};        ///< Σ m x [kg m]; divided by `mass`, the centre of mass
    double kinetic_energy = 0;            ///< Σ ½ m (|v|² + h²/inverse_inertia ‖C‖²) [J]
    double elastic_energy = 0;            ///< Σ V0 ψ [J]; NaN if the material has no energy_density
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

/// Returns a particle's material state with its values converted to double.
template <class To, class From>
To state_in_double(const From& state) {
    To exact;
    constexpr auto from = From::fields();
    constexpr auto to = To::fields();
    unroll<int(std::tuple_size_v<decltype(from)>)>([&](auto f) {
        const auto& member = state.*(std::get<f>(from).member);
        auto* numbers = components(exact.*(std::get<f>(to).member));
        auto copy = member;
        for (int k = 0; k < component_count<std::remove_cvref_t<decltype(member)>>; ++k)
            numbers[k] = double(components(copy)[k]);
    });
    return exact;
}

}  // namespace detail

/// Returns the totals of a set of particles. The sums are taken in the order of the particles' ids. They have the same
/// bits for any number of threads and any order of the particles in memory.
///
/// An affine field C has angular momentum and kinetic energy, like a body whose inertia per mass is h²/inverse_inertia
/// (Jiang, Schroeder and Teran 2017). If the kernel's inertia is not constant, affine fields do not contribute to the
/// totals.
/// \param threads  number of threads; 0: thread_count() chooses it
template <class Kernel, class Material, std::floating_point S, int D, class State>
Totals<D> totals(const Particles<S, D, State>& particles, const Domain<D>& domain, const Material& material,
                 int threads = 0) {
    double inertia = 0;
    if constexpr (has_inertia<Kernel>) inertia = domain.cell_size * domain.cell_size / Kernel::inverse_inertia;
    using Exact = with_scalar_t<Material, double>;
    const auto exact = lift<double>(material);

    const int workers = thread_count(threads);
    constexpr std::size_t chunk = 4096;
    std::vector<Totals<D>> parts((particles.size() + chunk - 1) / chunk);
    std::vector<std::uint32_t> slots;
    const auto sum_part = [&](std::size_t part, int) {
        Totals<D>& sum = parts[part];
        const std::size_t end = std::min(slots.size(), (part + 1) * chunk);
        for (std::size_t i = part * chunk; i < end; ++i) {
            const std::size_t slot = slots[i];
            const double mass = double(particles.mass(slot)), volume = double(particles.volume(slot));
            const Vec<double, D> x = particles.exact_position(slot), v = cast<double>(particles.velocity(slot));
            const Mat<double, D> C = cast<double>(particles.affine(slot));
            sum.particles += 1;
            sum.mass += mass;
            sum.momentum += v * mass;
            sum.first_moment += x * mass;
            sum.angular_momentum =
                sum.angular_momentum + (axial_product<double, D>(x, v) + detail::curl<D>(C) * inertia) * mass;
            sum.kinetic_energy += 0.5 * mass * (dot(v, v) + inertia * squared_norm(C));
            const auto state = detail::state_in_double<material_state_t<Exact, D>>(particles.state(slot));
            if constexpr (has_energy_density<Exact, D>)
                sum.elastic_energy += volume * energy_density(exact, state);
            else
                sum.elastic_energy = std::numeric_limits<double>::quiet_NaN();
            if constexpr (requires { state.dissipated; }) sum.dissipated_energy += volume * state.dissipated;
        }
    };
    parallel_region(workers, [&] {
        slots = slots_by_id(particles, workers);
        parallel_for(parts.size(), workers, sum_part);
    });
    Totals<D> sum;
    for (const Totals<D>& part : parts) sum += part;
    return sum;
}

}  // namespace firn
