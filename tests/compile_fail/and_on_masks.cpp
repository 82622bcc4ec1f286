// Masks are combined with & and |; && and || would look at one of them only.
// expect: firn: a policy cannot branch on a scalar
// expect: combine masks with & | !
#include <firn/core/strict.hpp>

template <firn::scalar S>
S hat(S x) {
#ifdef FIRN_GOOD
    return select((S(-1) < x) & (x < S(1)), S(1), S(0));
#else
    return select(S(-1) < x && x < S(1), S(1), S(0));
#endif
}

template firn::strict<double> hat(firn::strict<double>);
