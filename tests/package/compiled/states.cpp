/// \file Runs with firn::compiled_hdf5, of a common simulation and of a material that the library does not know, are
/// written, read and gone on from: they have the bits of a run that was not stopped.
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <cstdio>

/// A solid that the library does not know: τ = μ (F Fᵀ − I).
template <firn::scalar S = double>
struct Gel {
    S mu = S(1e5);  ///< [Pa]

    static constexpr const char* name = "gel";
    static constexpr auto parameters() { return std::tuple{firn::parameter{"mu", "Pa", &Gel::mu}}; }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        return (F * transpose(F) - firn::Mat<S, D>::identity()) * mu;
    }
    template <int D>
    S wave_speed(const S& density, const firn::Mat<S, D>& F) const {
        return firn::sqrt(S(3) * mu * squared_norm(F) / density);
    }
};

template <class Simulation, int D, class S>
bool goes_on(const Simulation& empty, const firn::Samples<D>& samples, const firn::Vec<double, D>& velocity, S) {
    Simulation whole = empty, again = empty;
    whole.add(samples, 1000.0, velocity);
    for (int k = 0; k < 10; ++k) whole.step();
    firn::write_state("state.hdf", firn::state_of(whole));
    firn::restore(again, firn::read_state<S>("state.hdf"));
    for (int k = 0; k < 10; ++k) whole.step(), again.step();
    return firn::state_of(whole) == firn::state_of(again);
}

/// A state in float is read into a simulation in double.
bool is_converted() {
    const firn::Domain<3> domain{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 8};
    firn::Simulation<3, Gel<float>> from(domain);
    firn::Simulation<3, Gel<double>> to(domain);
    from.add(firn::sample_sphere<3>({0.3, 0.3, 0.3}, 0.2, {.spacing = 1.0 / 16}), 1000.0, {1, -2, 1});
    from.step();
    firn::restore(to, firn::state_of(from), firn::Restart::converted);
    return to.particles().size() == from.particles().size() && to.time() == from.time();
}

int main() {
    const firn::Simulation<2> common({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 16});
    const firn::Simulation<3, Gel<>> own({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 8});
    const bool right =
        goes_on(common, firn::sample_box<2>({0.1, 0.1}, {0.4, 0.4}, {.spacing = 1.0 / 32}), {1, -2}, float()) &&
        goes_on(own, firn::sample_sphere<3>({0.3, 0.3, 0.3}, 0.2, {.spacing = 1.0 / 16}), {1, -2, 1}, double()) &&
        is_converted();
    if (!right) std::puts("firn::compiled_hdf5 goes on to other bits.");
    return right ? 0 : 1;
}
