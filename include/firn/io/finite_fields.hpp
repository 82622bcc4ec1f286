/// \file A check that writers of pictures' files share: these formats have no NaN and no infinity.
#pragma once

#include <firn/io/state.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace firn::inline FIRN_BUILD::detail {

/// Checks that all values of a field are finite.
/// \param what  what the field would be part of, for the message: "a PLY file"
/// \throws parameter_error  if a value is not finite; the message names the field and the particle
template <state_scalar S>
[[gnu::cold]] void check_finite(const State<S>& state, const StateField<S>& field, const char* what) {
    const auto bad = std::ranges::find_if(field.values, [](S value) { return !std::isfinite(value); });
    if (bad == field.values.end()) return;
    const std::size_t row = std::size_t(bad - field.values.begin()) / std::size_t(field.components);
    throw parameter_error(sentence("The field '", field.name, "' of particle ", state.id[row], " is ", *bad,
                                   "; only finite numbers can be written to ", what,
                                   ". Look for the step that made it so, or write a state (HDF5) to examine it."));
}

}  // namespace firn::inline FIRN_BUILD::detail
