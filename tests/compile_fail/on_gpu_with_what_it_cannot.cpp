// A GPU refuses simulations of another precision, with other sums and with contact groups; and accelerations that it
// cannot record or whose numbers it does not see.
// expect: firn: a GPU computes with float: give the simulation a material of float
// expect: firn: a GPU adds up integers of 32 bits: give the simulation firn::FixedPoint<std::int32_t>
// expect: firn: contact between groups of bodies is not yet on a GPU
// expect: firn: a GPU gets the numbers of an acceleration field from its list parameters()
// expect: firn: for a GPU, an acceleration field is called with a scalar that records its operations
#include <firn/firn.hpp>
#include <firn/simulation/require_gpu.hpp>

using namespace firn;
using Sums = FixedPoint<std::int32_t>;

template <class Material, class... Policies>
constexpr bool good = detail::require_gpu<SimulationWith<2, Material, Policies...>>();
using Elastic = FixedCorotated<float>;

template <class Acceleration>
constexpr bool acts = detail::require_gpu_acceleration<Acceleration, 2>();
constexpr double strength = 3;
constexpr auto pull = [](const auto& x) { return x * strength; };
constexpr auto captured = [by = strength](const auto& x) { return x * by; };
constexpr auto of_registers = [](const Vec<native_pack<float>, 2>& x) { return x; };

#ifdef FIRN_GOOD
static_assert(acts<Vec<double, 2>> && acts<Damped<float, 2, Attraction>> && acts<decltype(pull)>);
static_assert(good<Elastic, Sums, FBar, Asflip<>> && good<Elastic, Sums, Fmpm> &&
              good<Materials<Elastic, Snow<float>>, Sums, FBar>);
#else
static_assert(good<FixedCorotated<double>, Sums>);
static_assert(good<Elastic, Coloured> && good<Elastic, FixedPoint<std::int64_t>>);
static_assert(good<Elastic, Sums, CoulombContact>);
static_assert(acts<decltype(captured)>);
static_assert(acts<decltype(of_registers)>);
#endif
