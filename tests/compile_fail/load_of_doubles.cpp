// A load of doubles, or one whose parameters are doubles whatever the scalar, cannot be made differentiable.
// expect: firn: a differentiable load is a function of a position [m], in any scalar, and the time [s]
// expect: firn: this load has parameters(), but is not a template over the scalar
#include <firn/adjoint.hpp>

struct Pull {
    double strength;  // [N/m]
    static constexpr auto parameters() { return std::tuple{firn::parameter{"strength", "N/m", &Pull::strength}}; }
    template <class T>
    firn::Vec<T, 2> operator()(const firn::Vec<T, 2>& x, double) const {
        return x * -strength;
    }
};

void push(firn::Simulation<2>& simulation, const firn::Body& body) {
#ifdef FIRN_GOOD
    simulation.add_load(body, firn::differentiable_load([](const auto& x, double time) { return x * time; }));
#else
    simulation.add_load(body, firn::differentiable_load([](const firn::Vec<double, 2>& x, double) { return x; }));
    simulation.add_load(body, firn::differentiable_load(Pull{3}));
#endif
}
