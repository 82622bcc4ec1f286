// A stress for 3D only is no material in 2D; the sentence gives the signature.
// expect: firn: a material offers `Mat<S, D> kirchhoff_stress(const Mat<S, D>& F) const`
#include <firn/simulation.hpp>

template <firn::scalar S = float>
struct Jelly {
    S mu = S(1e4);

    static constexpr auto parameters() { return std::tuple{firn::parameter{"mu", "Pa", &Jelly::mu}}; }
#ifdef FIRN_GOOD
    template <int D>
#else
    template <int D>
        requires(D == 3)
#endif
    firn::Mat<S, D> kirchhoff_stress(const firn::Mat<S, D>& F) const {
        return (F * transpose(F) - firn::Mat<S, D>::identity()) * mu;
    }
    template <int D>
    S wave_speed(const S& density, const firn::Mat<S, D>& F) const {
        return sqrt((mu + mu) * squared_norm(F) / density);
    }
};

static_assert(firn::require_material<Jelly<>, 2>());
