// A kernel without gradients is named as such.
// expect: firn: a kernel offers a static gradients(f)
#include <firn/kernel/concept.hpp>

struct Hat {
    static constexpr int support = 2;
    static constexpr double base_shift = 0;
    static constexpr std::array<double, 2> largest_weight{1, 1};
    static constexpr double largest_gradient = 1;
    static constexpr double courant_limit = 1;

    template <firn::scalar S>
    static std::array<S, 2> weights(const S& f) {
        return {S(1) - f, f};
    }
#ifdef FIRN_GOOD
    template <firn::scalar S>
    static std::array<S, 2> gradients(const S&) {
        return {S(-1), S(1)};
    }
#endif
};

static_assert(firn::require_kernel<Hat>());
