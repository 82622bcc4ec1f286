// An adjoint refuses the policies that have no way back, each by itself.
// expect: firn: an Adjoint goes back through explicit simulations that sum with Coloured, on one rank, without
// errors: 4
#include <firn/adjoint.hpp>
#include <firn/firn.hpp>

using namespace firn;
using Elastic = FixedCorotated<float>;

#ifdef FIRN_GOOD
template <class... Policies>
using Of = Adjoint<SimulationWith<2, Elastic>>;
#else
template <class... Policies>
using Of = Adjoint<SimulationWith<2, Elastic, Policies...>>;
#endif
constexpr std::size_t sizes[] = {sizeof(Of<FixedPoint<std::int32_t>>), sizeof(Of<VolumeFilter>),
                                 sizeof(Of<CoulombContact>), sizeof(Of<GapContact<Walls<float, 2>>>)};
