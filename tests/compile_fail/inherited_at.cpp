// A material that inherits at() would lose what it adds: it is told to have its own.
// expect: firn: at(surroundings) of a material returns a material of the same type.
#include <firn/firn.hpp>

using namespace firn;

template <scalar S>
struct Warm : Hencky<S> {
    using scalar_type = S;
    template <class T>
    using with_scalar = Warm<T>;
    template <int D>
    Warm at(const Surroundings<S, D>&) const {
        return *this;
    }
};
template <scalar S>
struct Warmer : Warm<S> {
    using scalar_type = S;
    template <class T>
    using with_scalar = Warmer<T>;
#ifdef FIRN_GOOD
    template <int D>
    Warmer at(const Surroundings<S, D>&) const {
        return *this;
    }
#endif
};

void run() { Simulation<2, Warmer<float>>{Domain<2>{}}.step(); }
