// A material that is no template, which is what a newcomer writes first, is told what it has to be.
// expect: firn: a material is a template over its scalar, `template <firn::scalar S> struct MyMaterial`
// errors: 1
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
template <scalar S>
struct Spring {
#else
struct Spring {
    using S = float;
#endif
    S stiffness = S(1e5);  // [Pa]

    static constexpr auto parameters() { return std::tuple{parameter{"stiffness", "Pa", &Spring::stiffness}}; }
    template <int D>
    Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const {
        return (F * transpose(F) - Mat<S, D>::identity()) * stiffness;
    }
    template <int D>
    S wave_speed(const S& density, const Mat<S, D>& F) const {
        using firn::sqrt;
        return sqrt(stiffness / density) * (S(1) + squared_norm(F));
    }
};

void run() {
#ifdef FIRN_GOOD
    Simulation<3, Spring<float>> simulation(Domain<3>{});
#else
    Simulation<3, Spring> simulation(Domain<3>{});
#endif
    simulation.add(sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 0.1}), 1000);
    simulation.step();
}
