//! # Your own material
//!
//! Your own material is one small struct. The same code then runs in 2D and 3D, in float and double, in SIMD lanes,
//! with dual numbers (which compute derivatives), and on a GPU.
//!
//! ## The maths
//!
//! firn needs two functions of an elastic material:
//!
//! 1. The **Kirchhoff stress** τ = J σ = (∂ψ/∂F) Fᵀ [Pa]. F is the deformation gradient, J = det F, and ψ is the energy
//!    per undeformed volume.
//! 2. An upper bound of the **speed of sound** c [m/s]. A time step must be shorter than the time that sound takes to
//!    cross a cell.
//!
//! The example is soft tissue, which stiffens exponentially under strain (Demiray 1972):
//!
//!     ψ(F) = μ/(2k) (exp(k Q) − 1) + λ/2 (J − 1)²      with Q = tr FFᵀ − D − 2 ln J
//!
//! Since ∂Q/∂F = 2 (F − F⁻ᵀ) and ∂J/∂F = J F⁻ᵀ,
//!
//!     ∂ψ/∂F = μ exp(k Q) (F − F⁻ᵀ) + λ (J − 1) J F⁻ᵀ
//!     τ = (∂ψ/∂F) Fᵀ = μ exp(k Q) (FFᵀ − I) + λ (J − 1) J I
//!
//! **The speed of sound.** Let a be the direction of motion of a small wave, and n its direction of travel; both are
//! unit vectors. The wave deforms the matter to F + s (a ⊗ n) F. The second derivative of ψ by s is a · A a, where A is
//! the acoustic tensor. Divided by the density ρ₀ at rest, it is c². A bound for every a and n is enough. If the bound
//! is too large, the time steps are shorter than needed. If it is too small, the simulation is unstable. For this ψ:
//!
//!     d²Q/ds² = 2 |Fᵀn|² + 2 (a·n)²,     dQ/ds = 2 a · (FFᵀ − I) n,     d²J/ds² = 0,     dJ/ds = J (a·n)
//!     ρ₀ c² = μ exp(k Q) (|Fᵀn|² + (a·n)² + 2 k (a · (FFᵀ − I) n)²) + λ J² (a·n)²
//!           ≤ μ exp(k Q) (σ_max² + 1 + 2 k ‖FFᵀ − I‖²) + λ J²
//!
//! σ_max is the largest principal stretch. `firn::squared_stretch_bound(F)` returns a bound of σ_max² without a
//! singular value decomposition.
//!
//! In 2D, F is 2 × 2 and matter is in plane strain: nothing is stretched across the plane.
//!
//! ## The struct
//!
//! [own_material.hpp](../own_material.hpp)
//!
//! - Write `firn::sqrt`, `firn::abs`, `firn::exp`, `firn::log`, `firn::pow`, `firn::min`, `firn::max`. The functions of
//!   `std` accept neither SIMD lanes nor the scalar that writes WGSL.
//! - Write `firn::select(condition, a, b)` instead of `if` and `?:` on a value, because lanes compute both sides.
//! - `energy_density` is optional. `totals().elastic_energy` needs it, and so does the check of the stress below.
//! - A material that remembers more than F has its own struct template `state<D>` with `fields()`. Its functions then
//!   take the state instead of F. A plastic material also has a function `returned(trial)`. firn::VonMises is a short
//!   example. The top of `firn/material/concept.hpp` lists all members that a material may have.
//! - You can use `Eigen::Matrix<S, D, D>` instead of `firn::Mat<S, D>`: see `examples/eigen_material.hpp`.
//!
//! If something is missing or wrong, the compiler says so in a message that begins with "firn:".
//!
//! ## Small strains
//!
//! A float near 1 has steps of 6e-8, so F and J − 1 = det F − 1 do not see smaller strains. firn keeps F − I. A function
//! that takes any deformation gradient, and computes with its differences to the undeformed body, loses nothing:
//!
//! ```cpp
//! template <firn::deformation_gradient_of<S> G>
//! firn::matrix_of_t<G> kirchhoff_stress(const G& F) const {
//!     const S change = volume_change(F);                        // J − 1
//!     return left_cauchy_green_change(F) * stiffened(F) +       // FFᵀ − I
//!            firn::matrix_of_t<G>::diagonal(lambda * change * (S(1) + change));
//! }
//! ```
//!
//! There are also `displacement_gradient(F)` = F − I, `left_stretch_change(F)` = √(FFᵀ) − I, `logarithmic_strain(F)`, and
//! `firn::log(x, x_less_one)`. In a state of your own, write `firn::DeformationGradient<S, D> F;` in place of
//! `firn::Mat<S, D> F`, and `firn::VolumeRatio<S> J;` in place of `S J`. They are read and set as before. With `Mat` and
//! `S` everything works, too, and small strains are lost as in other codes.
//!
//! ## Check the derivative
//!
//! The most common mistake is a stress that is not the derivative of its energy. Dual numbers find this mistake: they
//! carry a derivative through every operation. In a flow with velocity gradient ∇v, dF/dt = ∇v F. So the energy changes
//! by dψ/dt = (∂ψ/∂F) : (∇v F) = τ : ∇v.
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
    //! Your material works like firn's own materials: in a simulation, among several materials, with parameters per
    //! particle, and in states. If it is plastic and bears tension however far it is stretched, give it a function
    //! `stretch_bound(state)`, as firn::VonMises has: firn then warns before it breaks for want of particles.
    const firn::Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 32};
    firn::Simulation simulation(box, SoftTissue<float>{.mu = 2e4F, .lambda = 3e4F});
    simulation.add(firn::sample_sphere<3>({0.5, 0.25, 0.5}, 0.2, {.spacing = 1.0 / 64}), 1000.0, {0.0, -2.0, 0.0});
    simulation.advance(0.1);
    const auto totals = simulation.totals();
    std::printf("after 0.1 s the ball's centre is at a height of %.3f m\n", totals.first_moment[1] / totals.mass);
    return std::abs(by_dual - by_stress) < 1e-9 * std::abs(by_dual) ? 0 : 1;
}
