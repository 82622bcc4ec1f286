// A header that is read before those of traced numbers calls firn::exp and its like with them, too; std::exp takes
// numbers of C++ only.
// expect: no matching function for call to
#include <firn/math/elementary.hpp>

#include <cmath>

template <firn::scalar S>
S stiffened(const S& x) {
#ifdef FIRN_GOOD
    return firn::exp(x) + firn::log(x) + firn::sin(x) * firn::cos(x) + firn::pow(x, x);
#else
    return std::exp(x);
#endif
}

#include <firn/math/traced.hpp>

firn::traced<double> traced(const firn::traced<double>& x) { return stiffened(x); }
