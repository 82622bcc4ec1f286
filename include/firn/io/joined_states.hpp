/// \file Joins the states of several sets of particles to one, so that one file shows all materials of a run.
#pragma once

#include <firn/io/state.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Returns a state with the points and facets of all these states, one state after the other. It has the fields that
/// all of them have, with the same unit and number of components, and the field `set` [1]: the index (from 0) of the
/// state that a point is from. Points keep their bodies and get new ids: 0, 1, …. Step and time are those of the first
/// state. The result is for pictures; no run can continue from it.
/// \param states  the states of sets, such as state_of() returns; of one dimension and one time
/// \throws parameter_error  if there are no states, if they differ in dimension or time, or if the parts of a state do
///                          not fit together (see check_state())
template <state_scalar S>
[[nodiscard]] State<S> joined(std::span<const State<S>> states) {
    if (states.empty()) throw parameter_error("There are no states to join; give one for each set of particles.");
    State<S> all;
    all.dimension = states[0].dimension;
    all.step = states[0].step;
    all.time = states[0].time;
    all.last_time_step = states[0].last_time_step;
    std::size_t points = 0;
    for (const State<S>& state : states) {
        check_state(state);
        if (state.dimension != all.dimension || state.time != all.time)
            throw parameter_error(sentence("A state of ", state.dimension, " dimensions after ", state.time,
                                           " s cannot be joined with one of ", all.dimension, " after ", all.time,
                                           " s; give the states of one run at one time."));
        points += state.size();
    }
    for (const StateField<S>& field : states[0].fields) {
        const bool common = field.name != "set" && std::ranges::all_of(states, [&](const State<S>& state) {
                                const StateField<S>* same = state.find(field.name);
                                return same && same->unit == field.unit && same->components == field.components;
                            });
        if (!common) continue;
        StateField<S> of_all{field.name, field.unit, field.components, {}};
        of_all.values.reserve(points * std::size_t(field.components));
        for (const State<S>& state : states) {
            const std::vector<S>& values = state.field(field.name).values;
            of_all.values.insert(of_all.values.end(), values.begin(), values.end());
        }
        all.fields.push_back(std::move(of_all));
    }
    StateField<S> set{"set", "1", 1, {}};
    for (std::size_t k = 0; k < states.size(); ++k) {
        const auto first = std::int64_t(all.body.size());
        for (const std::int64_t corner : states[k].facets) all.facets.push_back(first + corner);
        all.body.insert(all.body.end(), states[k].body.begin(), states[k].body.end());
        set.values.insert(set.values.end(), states[k].size(), S(k));
    }
    all.fields.push_back(std::move(set));
    all.id.resize(points);
    for (std::size_t i = 0; i < points; ++i) all.id[i] = std::int64_t(i);
    return all;
}
/// Returns a state with the points and facets of all these states. \see joined(std::span<const State<S>>)
template <state_scalar S>
[[nodiscard]] State<S> joined(const std::vector<State<S>>& states) {
    return joined(std::span<const State<S>>(states));
}

}  // namespace firn::inline FIRN_BUILD
