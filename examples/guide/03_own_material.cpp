//! # Your own material
//!
//! A material of yours is one small struct. The same lines then run in 2D and 3D, in float and double, in SIMD lanes,
//! with dual numbers (which give derivatives) and on a GPU.
//!
//! ## The maths
//!
//! firn asks two things of an elastic material:
//!
//! 1. the **Kirchhoff stress** τ = J σ = (∂ψ/∂F) Fᵀ [Pa], where F is the deformation gradient, J = det F and ψ the
//!    energy per undeformed volume;
//! 2. a bound of the **speed of sound** c [m/s], since a time step must be shorter than the time that sound takes to
//!    cross a cell.
//!
//! Take soft tissue, which stiffens exponentially under strain (Demiray 1972):
//!
//!     ψ(F) = μ/(2k) (exp(k Q) − 1) + λ/2 (J − 1)²      with Q = tr FFᵀ − D − 2 ln J
//!
//! Since ∂Q/∂F = 2 (F − F⁻ᵀ) and ∂J/∂F = J F⁻ᵀ,
//!
//!     ∂ψ/∂F = μ exp(k Q) (F − F⁻ᵀ) + λ (J − 1) J F⁻ᵀ
//!     τ = (∂ψ/∂F) Fᵀ = μ exp(k Q) (FFᵀ − I) + λ (J − 1) J I
//!
//! **The speed of sound.** Matter that moves by a small wave, direction of motion a and direction of travel n, both unit
//! vectors, is deformed to F + s (a ⊗ n) F. The second derivative of ψ for s, which is a · A a with the acoustic tensor
//! A, over the density ρ₀ at rest is c². A bound for every a and n is enough: too large a value costs a shorter step,
//! too small a value makes the simulation unstable. Here
//!
//!     d²Q/ds² = 2 |Fᵀn|² + 2 (a·n)²,     dQ/ds = 2 a · (FFᵀ − I) n,     d²J/ds² = 0,     dJ/ds = J (a·n)
//!     ρ₀ c² = μ exp(k Q) (|Fᵀn|² + (a·n)² + 2 k (a · (FFᵀ − I) n)²) + λ J² (a·n)²
//!           ≤ μ exp(k Q) (σ_max² + 1 + 2 k ‖FFᵀ − I‖²) + λ J²
//!
//! where σ_max is the largest principal stretch. `firn::squared_stretch_bound(F)` is a bound of σ_max² without a singular
//! value decomposition.
//!
//! ## The struct
//!
//! [own_material.hpp](../own_material.hpp)
//!
//! - Write `firn::sqrt`, `firn::abs`, `firn::exp`, `firn::log`, `firn::pow`, `firn::min`, `firn::max`.
//!   `std::sqrt` knows neither SIMD lanes nor the scalar that writes WGSL.
//! - Write `firn::select(condition, a, b)` in place of `if` and `?:` on a value, because lanes take both sides.
//! - `energy_density` is optional. It gives `totals().elastic_energy`, and lets you check the stress, as below.
//! - A material with a memory has a struct template `state<D>` of its own with `fields()`, and takes that instead of
//!   F. A plastic one offers `returned(trial)`. firn::VonMises is a short example; the list of all that a material
//!   may offer is at the top of `firn/material/concept.hpp`.
//! - In Eigen's terms, `Eigen::Matrix<S, D, D>` in place of `firn::Mat<S, D>`: `examples/eigen_material.hpp`.
//!
//! What is missing or wrong is said by the compiler in a sentence that begins with "firn:".
//!
//! ## Check the derivative
//!
//! The commonest mistake is a stress that is not the derivative of its energy. Dual numbers find it: they carry a
//! derivative through every operation. Matter in a flow of velocity gradient ∇v has dF/dt = ∇v F, so that
//! dψ/dt = (∂ψ/∂F) : (∇v F) = τ : ∇v.
#include <firn/core/dual.hpp>
#include <firn/firn.hpp>

#include "../own_material.hpp"

#include <cstdio>

int main() {
    const SoftTissue<double> tissue{.mu = 2e4, .lambda = 3e4, .stiffening = 0.5};
    using Matrix = firn::Mat<double, 3>;  // braces give it by columns, Mat::rows by rows
    const auto F = Matrix::rows(1.1, 0.1, 0.0, -0.05, 0.95, 0.1, 0.0, 0.02, 1.05);
    const auto velocity_gradient = Matrix::rows(0.3, -0.2, 0.1, 0.5, 0.4, -0.6, 0.2, 0.1, -0.3);  // [1/s]
    const Matrix rate = velocity_gradient * F;

    using Dual = firn::dual<double>;
    firn::Mat<Dual, 3> moving;
    for (int i = 0; i < 9; ++i) moving.m[i] = Dual(F.m[i], rate.m[i]);
    const double by_dual = SoftTissue<Dual>{Dual(2e4), Dual(3e4), Dual(0.5)}.energy_density(moving).derivative;
    const auto stress = tissue.kirchhoff_stress(F);
    double by_stress = 0;
    for (int i = 0; i < 9; ++i) by_stress += stress.m[i] * velocity_gradient.m[i];
    std::printf("dψ/dt: %.10g W/m³ by dual numbers, %.10g W/m³ by the stress\n", by_dual, by_stress);

    //! ## Use it
    //!
    //! It is a material like firn's own: in a simulation, among several, per particle, in states.
    const firn::Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 32};
    firn::Simulation simulation(box, SoftTissue<float>{.mu = 2e4F, .lambda = 3e4F});
    simulation.add(firn::sample_sphere<3>({0.5, 0.25, 0.5}, 0.2, {.spacing = 1.0 / 64}), 1000.0, {0.0, -2.0, 0.0});
    simulation.advance(0.1);
    const auto totals = simulation.totals();
    std::printf("after 0.1 s the ball's centre is at a height of %.3f m\n", totals.first_moment[1] / totals.mass);
    return std::abs(by_dual - by_stress) < 1e-9 * std::abs(by_dual) ? 0 : 1;
}
