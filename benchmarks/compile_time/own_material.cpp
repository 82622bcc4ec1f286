/// \file The same program with states, for a material of the user's own that no library has compiled.
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

/// Soft tissue: τ = μ exp(k Q) (FFᵀ − I) + λ (J − 1) J I with Q = tr FFᵀ − 3 − 2 ln J. \see examples/own_material.hpp
template <firn::scalar S = float>
struct Tissue {
    S mu = S(4e5), lambda = S(6e5);  ///< [Pa]
    S stiffening = S(0.5);           ///< k [1]

    static constexpr const char* name = "tissue";
    static constexpr auto parameters() {
        return std::tuple{firn::parameter{"mu", "Pa", &Tissue::mu}, firn::parameter{"lambda", "Pa", &Tissue::lambda},
                          firn::parameter{"stiffening", "1", &Tissue::stiffening}};
    }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        using Matrix = firn::Mat<S, D>;
        const S J = determinant(F);
        return (F * transpose(F) - Matrix::identity()) * stiffened(F, J) + Matrix::diagonal(lambda * (J - S(1)) * J);
    }
    template <int D>
    S wave_speed(const S& density, const firn::Mat<S, D>& F) const {
        const S J = determinant(F);
        return firn::sqrt((stiffened(F, J) * S(4) * squared_norm(F) + lambda * J * J) / density);
    }

private:
    template <int D>
    S stiffened(const firn::Mat<S, D>& F, const S& J) const {
        return mu * firn::exp(stiffening * (squared_norm(F) - S(D) - S(2) * firn::log(J)));
    }
};

int main() {
    firn::Simulation<3, Tissue<>> simulation({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64});
    simulation.add(firn::sample_box<3>({0.1, 0.5, 0.4}, {0.35, 0.75, 0.65}, {.spacing = 1.0 / 128}), 1000.0);
    simulation.advance(0.1);
    firn::write_state("state.hdf", firn::state_of(simulation));
    firn::restore(simulation, firn::read_state<float>("state.hdf"));
}
