/// \file Manufactured solutions: motions that are prescribed, and the body force that neo-Hookean matter needs for
/// them. Wallstedt and Guilkey 2008; Sadeghirad, Brannon and Burghardt 2011 (axis-aligned); Kamojjala, Brannon,
/// Sadeghirad and Guilkey 2015 (generalised vortex).
#pragma once

#include <firn/firn.hpp>

#include "sides.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace verification {

using std::numbers::pi;

/// What matter consists of: the moduli of firn::NeoHookean, and the density [Pa, kg/m^D].
struct Matter {
    double mu, lambda, density;
    double young() const { return mu * (3 * lambda + 2 * mu) / (lambda + mu); }
    double wave_speed() const { return std::sqrt((lambda + 2 * mu) / density); }
};

/// u_i = A sin(πX_i) sin(π(ct + φ_i)), c = √(E/ρ): waves that stand along the axes; no displacement at whole X_i.
template <int D>
struct AxisAligned {
    using Vector = firn::Vec<double, D>;
    using Matrix = firn::Mat<double, D>;

    Matter matter;
    double amplitude;  ///< A [m]

    double c() const { return std::sqrt(matter.young() / matter.density); }
    double period() const { return 2 / c(); }
    double phase(int i, double t) const { return pi * (c() * t + 2. / 3 * i); }

    Vector position(const Vector& X, double t) const {
        Vector x = X;
        for (int i = 0; i < D; ++i) x[i] += amplitude * std::sin(pi * X[i]) * std::sin(phase(i, t));
        return x;
    }
    Vector velocity(const Vector& X, double t) const {
        Vector v{};
        for (int i = 0; i < D; ++i) v[i] = amplitude * pi * c() * std::sin(pi * X[i]) * std::cos(phase(i, t));
        return v;
    }
    Matrix deformation_gradient(const Vector& X, double t) const {
        Matrix F = Matrix::identity();
        for (int i = 0; i < D; ++i) F(i, i) += amplitude * pi * std::cos(pi * X[i]) * std::sin(phase(i, t));
        return F;
    }
    /// ∂F/∂t [1/s]
    Matrix deformation_rate(const Vector& X, double t) const {
        Matrix rate = Matrix::zero();
        for (int i = 0; i < D; ++i)
            rate(i, i) = amplitude * pi * pi * c() * std::cos(pi * X[i]) * std::cos(phase(i, t));
        return rate;
    }
    /// b_i = π² u_i/ρ (μ (1 + F_i⁻²) + λ (1 − ln J) F_i⁻² − E) [N/kg]
    Vector body_force(const Vector& X, double t) const {
        const Vector u = position(X, t) - X;
        const Matrix F = deformation_gradient(X, t);
        const double log_J = std::log(determinant(F));
        Vector b{};
        for (int i = 0; i < D; ++i) {
            const double squared = 1 / (F(i, i) * F(i, i));
            b[i] = pi * pi * u[i] / matter.density *
                   (matter.mu * (1 + squared) + matter.lambda * (1 - log_J) * squared - matter.young());
        }
        return b;
    }
};

/// u_i = A sin(πX) sin(πY) sin(π(ct + φ_i)), c = √(E/ρ): no displacement at the borders of the unit square, so matter
/// sticks to them. Shear waves run along the borders, and both components of F depend on both coordinates.
struct StuckWaves {
    using Vector = firn::Vec<double, 2>;
    using Matrix = firn::Mat<double, 2>;

    Matter matter;
    double amplitude;  ///< A [m]

    double c() const { return std::sqrt(matter.young() / matter.density); }
    double period() const { return 2 / c(); }
    double phase(int i, double t) const { return pi * (c() * t + 2. / 3 * i); }

    static double shape(const Vector& X) { return std::sin(pi * X[0]) * std::sin(pi * X[1]); }
    static Vector gradient(const Vector& X) {
        return Vector{std::cos(pi * X[0]) * std::sin(pi * X[1]), std::sin(pi * X[0]) * std::cos(pi * X[1])} * pi;
    }
    /// A sin(π(ct + φ_i)), and its derivative by t.
    Vector swing(double t) const { return Vector{std::sin(phase(0, t)), std::sin(phase(1, t))} * amplitude; }
    Vector swing_rate(double t) const {
        return Vector{std::cos(phase(0, t)), std::cos(phase(1, t))} * (amplitude * pi * c());
    }

    Vector position(const Vector& X, double t) const { return X + swing(t) * shape(X); }
    Vector velocity(const Vector& X, double t) const { return swing_rate(t) * shape(X); }
    Matrix deformation_gradient(const Vector& X, double t) const {
        return Matrix::identity() + firn::outer(swing(t), gradient(X));
    }
    /// ∂F/∂t [1/s]
    Matrix deformation_rate(const Vector& X, double t) const { return firn::outer(swing_rate(t), gradient(X)); }
    /// With the shape f of u = a f, F = I + a ⊗ ∇f, J = 1 + a · ∇f and F⁻ᵀ = I − ∇f ⊗ a/J. As ∂_j (J F⁻ᵀ_ij) = 0,
    /// ∂_j P_ij = μ a_i Δf + (μ + λ (1 − ln J)) F⁻ᵀ_ij ∂_j J/J with ∂_j J = a_k ∂²f/∂X_j ∂X_k. [N/kg]
    Vector body_force(const Vector& X, double t) const {
        const Vector a = swing(t), slope = gradient(X);
        const double f = shape(X), mixed = pi * pi * std::cos(pi * X[0]) * std::cos(pi * X[1]);
        const double J = 1 + dot(a, slope), share = matter.mu + matter.lambda * (1 - std::log(J));
        const Vector by_J = Vector{mixed * a[1] - pi * pi * f * a[0], mixed * a[0] - pi * pi * f * a[1]} * (1 / J);
        const Vector divergence = a * (-2 * pi * pi * f * matter.mu) + (by_J - slope * (dot(a, by_J) / J)) * share;
        return a * (-pi * pi * c() * c() * f) - divergence * (1 / matter.density);
    }
};

/// A ring of radii 0.75 to 1.25 m turns by α = A sin(πt) h(R), h = (1 − 16 (R − 1)²)²: its borders neither move nor
/// bear traction, J = 1, and the shear R ∂α/∂R is up to 6.2 A.
struct Vortex {
    using Vector = firn::Vec<double, 2>;
    using Matrix = firn::Mat<double, 2>;

    Matter matter;
    double amplitude;  ///< A [rad]
    static constexpr double inner = 0.75, outer = 1.25;

    double period() const { return 2; }

    /// α and its derivatives by R and t.
    struct Turn {
        double angle, by_R, by_RR, by_t, by_tt, by_Rt;
    };
    Turn turn(double R, double t) const {
        const double x = R - 1, well = 1 - 16 * x * x;
        const double h = well * well, h_R = -64 * x * well, h_RR = -64 * (1 - 48 * x * x);
        const double g = amplitude * std::sin(pi * t), g_t = amplitude * pi * std::cos(pi * t);
        return {g * h, g * h_R, g * h_RR, g_t * h, -pi * pi * g * h, g_t * h_R};
    }
    static Matrix rotation(double angle) {
        return Matrix::rows(std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle));
    }
    static Vector across(const Vector& x) { return {-x[1], x[0]}; }

    Vector position(const Vector& X, double t) const { return rotation(turn(norm(X), t).angle) * X; }
    Vector velocity(const Vector& X, double t) const { return across(position(X, t)) * turn(norm(X), t).by_t; }
    /// F = Q + across(x) ⊗ ∂α/∂X
    Matrix deformation_gradient(const Vector& X, double t) const {
        const Turn now = turn(norm(X), t);
        return rotation(now.angle) + firn::outer(across(position(X, t)), X * (now.by_R / norm(X)));
    }
    Matrix deformation_rate(const Vector& X, double t) const {
        const double R = norm(X);
        const Turn now = turn(R, t);
        const Vector x = position(X, t), along = X * (1 / R);
        return rotation(now.angle + pi / 2) * now.by_t - firn::outer(x, along) * (now.by_R * now.by_t) +
               firn::outer(across(x), along) * now.by_Rt;
    }
    /// Along e_r: −R α_t² + μ R α_R²/ρ; across it: R α_tt − μ (3 α_R + R α_RR)/ρ. In polar coordinates
    /// τ = μ ((0, s), (s, s²)), s = R α_R. [N/kg]
    Vector body_force(const Vector& X, double t) const {
        const double R = norm(X), stiffness = matter.mu / matter.density;
        const Turn now = turn(R, t);
        const Vector along = position(X, t) * (1 / R);
        return along * (R * (stiffness * now.by_R * now.by_R - now.by_t * now.by_t)) +
               across(along) * (R * now.by_tt - stiffness * (3 * now.by_R + R * now.by_RR));
    }
};

/// Particles on circles, about h/2 apart, as many on each as its length asks for; each circle is turned against the
/// last. All borders are circles: those of a lattice would be stairs.
inline firn::Samples<2> ring_samples(double h) {
    firn::Samples<2> samples;
    const int circles = int(std::lround((Vortex::outer - Vortex::inner) / (h / 2)));
    const double apart = (Vortex::outer - Vortex::inner) / circles;
    for (int k = 0; k < circles; ++k) {
        const double R = Vortex::inner + (k + 0.5) * apart;
        const int count = int(std::lround(2 * pi * R / apart));
        for (int j = 0; j < count; ++j) {
            const double angle = 2 * pi * (j + 0.37 * k) / count;
            samples.positions.push_back({R * std::cos(angle), R * std::sin(angle)});
        }
    }
    const double area = pi * (Vortex::outer * Vortex::outer - Vortex::inner * Vortex::inner);
    samples.volume = area / double(samples.positions.size());
    return samples;
}

/// Of displacements [m], over particles.
struct DisplacementError {
    double mean_square = 0, largest = 0;  ///< √(Σ |x − x_exact|²/n), and the largest
};

/// A body that begins as the solution does, each particle pushed by the body force of where it was at first. (The force
/// of where it is now would act on errors of position as a spring of either sign.)
template <class S, class Solution, class Transfer, class Force, class Kernel>
struct Manufactured {
    using Vector = firn::Vec<double, 2>;

    Solution solution;
    std::vector<Vector> X;  ///< of each particle, by its id
    firn::Simulation<2, firn::NeoHookean<S>, Transfer, Force, Kernel> simulation;

    /// \param time_step  fixed [s]
    /// \param staggered  velocities begin half a step before positions, as leapfrog has them; else at once
    Manufactured(const Solution& of, const firn::Domain<2>& domain, const firn::Samples<2>& samples, double time_step,
                 bool staggered = true, const Transfer& transfer = {}, const Sides& sides = {})
        : solution(of), X(samples.positions), simulation(domain, {S(of.matter.mu), S(of.matter.lambda)}) {
        simulation.gravity = {0.0, 0.0};
        simulation.transfer = transfer;
        simulation.fixed_time_step = time_step;
        simulation.boundary.nodes_behind = sides.nodes_behind;
        for (std::size_t a = 0; a < 2; ++a)
            if (!domain.periodic[a])
                simulation.boundary.at_lower[a] = simulation.boundary.at_upper[a] = {sides.contact, 0};
        firn::Samples<2> moved = samples;
        for (Vector& x : moved.positions) x = solution.position(x, 0);
        if (domain.periodic[0])
            for (Vector& x : moved.positions)
                for (int a = 0; a < 2; ++a) x[a] -= extent(a) * std::floor((x[a] - domain.lower[a]) / extent(a));
        simulation.add(moved, solution.matter.density);
        auto& particles = simulation.edit_particles();
        const double when = staggered ? -time_step / 2 : 0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const Vector& from = X[particles.id(slot)];
            auto state = particles.state(slot);
            state.F = firn::cast<S>(solution.deformation_gradient(from, 0));
            particles.set_state(slot, state);
            particles.set_velocity(slot, firn::cast<S>(solution.velocity(from, when)));
            if (Transfer::affine)
                particles.set_affine(slot, firn::cast<S>(solution.deformation_rate(from, when) *
                                                         inverse(solution.deformation_gradient(from, when))));
        }
    }

    /// As a load does: each particle with the body force of its X.
    void step() {
        auto& particles = simulation.edit_particles();
        const double dt = simulation.fixed_time_step;
        firn::parallel_for(
            particles.slots() / firn::pack_size, firn::thread_count(0),
            [&](std::size_t pack, int) {
                for (std::size_t slot = pack * firn::pack_size; slot < (pack + 1) * firn::pack_size; ++slot)
                    if (particles.is_particle(slot))
                        particles.set_velocity(
                            slot,
                            particles.velocity(slot) +
                                firn::cast<S>(solution.body_force(X[particles.id(slot)], simulation.time()) * dt));
            },
            16);
        simulation.step();
    }

    DisplacementError error() const {
        const auto& particles = simulation.particles();
        const auto& domain = simulation.domain();
        DisplacementError error;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            Vector off = particles.exact_position(slot) - solution.position(X[particles.id(slot)], simulation.time());
            for (int a = 0; a < 2; ++a)
                if (domain.periodic[std::size_t(a)]) off[a] -= extent(a) * std::round(off[a] / extent(a));
            error.mean_square += dot(off, off);
            error.largest = std::max(error.largest, norm(off));
        }
        error.mean_square = std::sqrt(error.mean_square / double(particles.size()));
        return error;
    }

private:
    double extent(int a) const { return simulation.domain().upper[a] - simulation.domain().lower[a]; }
    static firn::Mat<double, 2> inverse(const firn::Mat<double, 2>& F) {
        return firn::Mat<double, 2>::rows(F(1, 1), -F(0, 1), -F(1, 0), F(0, 0)) * (1 / determinant(F));
    }
};

}  // namespace verification
