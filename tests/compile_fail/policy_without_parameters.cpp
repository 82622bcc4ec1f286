// A policy with scalar fields must list them, or they could not become lanes.
// expect: firn: a policy with a scalar parameter type must list its fields in a static function parameters()
#include <firn/core/pack.hpp>
#include <firn/core/parameters.hpp>

template <firn::scalar S>
struct Wind {
    S speed;
#ifdef FIRN_GOOD
    static constexpr auto parameters() { return std::tuple{firn::parameter{"speed", "m/s", &Wind::speed}}; }
#endif
};

auto lanes(const Wind<float>& wind) { return firn::lift<firn::native_pack<float>>(wind).speed; }
