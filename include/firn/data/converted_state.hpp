/// \file The state of a material with another scalar.
#pragma once

#include <firn/data/particle_view.hpp>

namespace firn::inline FIRN_BUILD::detail {

/// Returns a particle's material state with its numbers converted to another scalar.
/// \tparam To  the type of the state with that scalar
template <class To, class From>
FIRN_INLINE To converted_state(const From& from) {
    To to;
    constexpr auto in = From::fields();
    constexpr auto out = To::fields();
    unroll<int(std::tuple_size_v<decltype(in)>)>([&](auto f) FIRN_LAMBDA {
        const auto& member = from.*(std::get<f>(in).member);
        auto& converted = to.*(std::get<f>(out).member);
        using Converted = Stored<std::remove_cvref_t<decltype(converted)>>;
        const auto numbers = Stored<std::remove_cvref_t<decltype(member)>>::numbers(member);
        std::array<typename Converted::Number, numbers.size()> others;
        unroll<int(numbers.size())>([&](auto k) FIRN_LAMBDA { others[k] = typename Converted::Number(numbers[k]); });
        converted = Converted::made(others);
    });
    return to;
}

}  // namespace firn::inline FIRN_BUILD::detail
