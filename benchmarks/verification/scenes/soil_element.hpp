/// \file A cube of Mohr–Coulomb soil that is strained along the axes.
#pragma once

#include <firn/core/eigen.hpp>
#include <firn/material/mohr_coulomb.hpp>

#include <cmath>

namespace verification {

/// A cube that is strained along the axes, with what has flowed.
struct Element {
    using Vector = Eigen::Vector3d;

    firn::MohrCoulomb<double> model;
    firn::MohrCoulomb<double>::state<3> soil{};
    Vector strain = Vector::Zero();  ///< all of its logarithmic strain

    Vector stress() const {
        const firn::Mat<double, 3> tau = firn::kirchhoff_stress(model, soil);
        return {tau(0, 0), tau(1, 1), tau(2, 2)};
    }
    Vector plastic() const {
        return strain - Vector{std::log(soil.F(0, 0)), std::log(soil.F(1, 1)), std::log(soil.F(2, 2))};
    }
    Element strained_by(const Vector& step) const {
        firn::Mat<double, 3> rate = firn::Mat<double, 3>::zero();
        for (int i = 0; i < 3; ++i) rate(i, i) = std::expm1(step[i]);
        return {model, firn::updated(model, soil, rate, 1.0), strain + step};
    }
    /// Strained along the axes with a part that keeps the stress along axis `kept` [Pa], by bisection.
    Element strained_with(const Vector& step, const Vector& part, int kept, double stress_there) const {
        double low = -0.02, high = 0.02;
        for (int i = 0; i < 80; ++i) {
            const double middle = 0.5 * (low + high);
            (strained_by(step + middle * part).stress()[kept] < stress_there ? low : high) = middle;
        }
        return strained_by(step + 0.5 * (low + high) * part);
    }
};

/// The strengths of soil in principal stresses, positive in compression: σ₁ = σ₃ N_φ + 2 c √N_φ.
struct SoilStrength {
    double cohesion, N_phi;  ///< c [Pa], (1 + sin φ)/(1 − sin φ)

    SoilStrength(double c, firn::Angle friction)
        : cohesion(c), N_phi((1 + std::sin(friction.in_radians())) / (1 - std::sin(friction.in_radians()))) {}
    /// The largest pressure that a smallest one holds [Pa].
    double major(double minor) const { return minor * N_phi + 2 * cohesion * std::sqrt(N_phi); }
    /// The smallest pressure that holds a largest one [Pa].
    double minor(double major) const { return (major - 2 * cohesion * std::sqrt(N_phi)) / N_phi; }
};

}  // namespace verification
