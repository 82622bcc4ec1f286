/// \file The names of policies, including those of policies that consist of other policies.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

namespace firn::inline FIRN_BUILD {

/// Returns P::name, or "unnamed" if P has no member `name`.
template <class P>
constexpr std::string_view name_of() {
    if constexpr (requires { P::name; })
        return P::name;
    else
        return "unnamed";
}

namespace detail {

/// Joins the names of the policies P… with underscores. The member `text` holds the result.
template <class... P>
struct joined_names {
    static constexpr auto characters = [] {
        std::array<char, (std::size_t(0) + ... + (name_of<P>().size() + 1))> all{};
        auto end = all.begin();
        ((end = std::copy_n(name_of<P>().data(), name_of<P>().size(), end), *end++ = '_'), ...);
        all.back() = '\0';
        return all;
    }();
    static constexpr const char* text = characters.data();
};

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
