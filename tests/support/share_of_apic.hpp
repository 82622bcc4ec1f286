/// \file A transfer of a user's own, with a parameter.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/core/tensor.hpp>

#include <tuple>

namespace test_support {

/// APIC of which particles keep a share of the affine field.
template <firn::scalar S>
struct ShareOfApic {
    static constexpr const char* name = "share_of_apic";
    static constexpr bool affine = true;
    S share = S(0.5);
    static constexpr auto parameters() { return std::tuple{firn::parameter{"share", "1", &ShareOfApic::share}}; }
    template <class T, int D>
    firn::Mat<T, D> affine_field(const firn::Mat<T, D>& C) const {
        return C * share;
    }
};

}  // namespace test_support
