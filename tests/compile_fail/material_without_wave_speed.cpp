// A simulation says which function a material lacks, and what it is for.
// expect: firn: a material offers `S wave_speed(const S& density, const Mat<S, D>& F) const`
// expect: the time step is bounded by it
#include <firn/simulation.hpp>

template <firn::scalar S = float>
struct Jelly {
    S mu = S(1e4);

    static constexpr const char* name = "jelly";
    static constexpr auto parameters() { return std::tuple{firn::parameter{"mu", "Pa", &Jelly::mu}}; }
    template <int D>
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        return (F * transpose(F) - firn::Mat<S, D>::identity()) * mu;
    }
#ifdef FIRN_GOOD
    template <int D>
    S wave_speed(const S& density, const firn::Mat<S, D>& F) const {
        return sqrt((mu + mu) * squared_norm(F) / density);
    }
#endif
};

void run() { firn::Simulation<3, Jelly<>>{firn::Domain<3>{}}.step(); }
