// `?:` on a mask of lanes is refused in the same sentence as `if`, with the scalar that simulations run on.
// expect: firn: a policy cannot branch on a scalar with `if`, `?:`
// expect: Write select(mask, a, b)
#include <firn/core/pack.hpp>

template <firn::scalar S>
S ramp(S x) {
#ifdef FIRN_GOOD
    return select(x < S(0), S(0), x);
#else
    return x < S(0) ? S(0) : x;
#endif
}

template firn::native_pack<float> ramp(firn::native_pack<float>);
