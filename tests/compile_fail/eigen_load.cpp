// A load that returns an Eigen expression, which may refer to what is gone, is refused.
// expect: firn: this load returns an expression, which refers to values that are gone
#include <firn/core/eigen.hpp>
#include <firn/simulation.hpp>

void push(firn::Simulation<2>& simulation, const firn::Body& body) {
#ifdef FIRN_GOOD
    simulation.add_load(body, [](Eigen::Vector2d x, double) -> Eigen::Vector2d { return -2 * x; });
#else
    simulation.add_load(body, [](Eigen::Vector2d x, double) { return -2 * x; });
#endif
}
