// A GPU refuses simulations of another precision, with other sums and with contact groups.
// expect: firn: a GPU computes with float: give the simulation a material of float
// expect: firn: a GPU adds up integers of 32 bits: give the simulation firn::FixedPoint<std::int32_t>
// expect: firn: contact between groups of bodies is not yet on a GPU
#include <firn/firn.hpp>
#include <firn/simulation/require_gpu.hpp>

using namespace firn;
using Sums = FixedPoint<std::int32_t>;

template <class Material, class... Policies>
constexpr bool good = detail::require_gpu<SimulationWith<2, Material, Policies...>>();
using Elastic = FixedCorotated<float>;

#ifdef FIRN_GOOD
static_assert(good<Elastic, Sums, FBar, Asflip<>> && good<Elastic, Sums, Fmpm> &&
              good<Materials<Elastic, Snow<float>>, Sums, FBar>);
#else
static_assert(good<FixedCorotated<double>, Sums>);
static_assert(good<Elastic, Coloured> && good<Elastic, FixedPoint<std::int64_t>>);
static_assert(good<Elastic, Sums, CoulombContact>);
#endif
