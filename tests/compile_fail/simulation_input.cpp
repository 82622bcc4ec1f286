// What a simulation is given, and cannot use, is said in a sentence each.
// expect: firn: after the domain, a simulation is given a material of the type that it names
// expect: firn: a simulation computes with float or double. Dual numbers
// expect: firn: the density of a body is the second argument, a number
// expect: firn: a load is a function of a position [m] and the time [s]
// expect: firn: this acceleration has another dimension than the simulation and the grid
// expect: firn: an acceleration is a vector [m/s^2], a field such as
// errors: 8
#include <firn/core/dual.hpp>
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
using Material = FixedCorotated<float>;
using S = double;
template <class P>
using X = Vec<P, 2>;
constexpr int N = 2;
double given(double density) { return density; }
const auto push = [](const Vec<double, 2>& x, double) { return x; };
const auto& scaled(const auto& x, const auto&) { return x; }
#else
using Material = Sand<float>;
using S = dual<double>;
template <class P>
using X = Vec<double, 2>;
constexpr int N = 3;
detail::NamedDensity<2> given(double density) { return {.density = density}; }
const auto push = [](double) { return 1.0; };
const auto& scaled(const auto&, const auto& number) { return number; }
#endif

const Domain<2> box;
void materials() {
    const Simulation<2> of_another_material(box, Material{});
    const Simulation of_dual_numbers(box, FixedCorotated<S>{});
}
void bodies(Simulation<2>& simulation, const Samples<2>& samples) {
    simulation.add_load(simulation.add(samples, given(1000)), push);
}
void accelerations(Simulation<2>& simulation) {
    simulation.step({0, -9.81});
    simulation.step(Vec<double, N>::zero());
    simulation.step(Gravity<float, N>{});
    simulation.step([]<class P>(const X<P>& x) { return x; });
    simulation.advance(1, [](const auto& x) { return scaled(x, x[0]); });
}
