// A definition that branches on a scalar is refused in a sentence that says what to write instead.
// expect: firn: a policy cannot branch on a scalar with `if`
// expect: Write select(mask, a, b)
#include <firn/core/strict.hpp>

template <firn::scalar S>
S ramp(S x) {
#ifdef FIRN_GOOD
    return select(x < S(0), S(0), x);
#else
    if (x < S(0)) return S(0);
    return x;
#endif
}

template firn::strict<float> ramp(firn::strict<float>);
