// A material that returns an Eigen expression of what is gone when it has returned is refused, not dangled.
// expect: firn: this function returns an expression, which refers to values that are gone
#include <firn/core/eigen.hpp>
#include <firn/material/concept.hpp>

#include <cmath>

template <firn::scalar S = float>
struct Jelly {
    S mu = S(1e4);

    static constexpr auto parameters() { return std::tuple{firn::parameter{"mu", "Pa", &Jelly::mu}}; }
    template <int D>
#ifdef FIRN_GOOD
    Eigen::Matrix<S, D, D>
#else
    auto
#endif
    kirchhoff_stress(const Eigen::Matrix<S, D, D>& F) const {
        return mu * (F * F.transpose() - Eigen::Matrix<S, D, D>::Identity());
    }
    template <int D>
    S wave_speed(const S& density, const Eigen::Matrix<S, D, D>& F) const {
        using std::sqrt;
        return sqrt((mu + mu) * F.squaredNorm() / density);
    }
};

static_assert(firn::require_material<Jelly<>, 2>());
