/// \file What states of all kinds of runs share: parameters as numbers, tables by name, whether a run is the same.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/io/state.hpp>

#include <algorithm>
#include <string>
#include <type_traits>
#include <vector>

namespace firn {

namespace detail {

template <class S>
    requires std::is_arithmetic_v<S>
std::vector<double> as_doubles(S value) {
    return {double(value)};
}
template <class S, int D>
std::vector<double> as_doubles(const Vec<S, D>& value) {
    return {value.v, value.v + D};
}

inline std::string compiler_name() {
#if defined(__clang__)
    return sentence("clang ", __clang_major__, ".", __clang_minor__, ".", __clang_patchlevel__);
#else
    return sentence("g++ ", __GNUC__, ".", __GNUC_MINOR__, ".", __GNUC_PATCHLEVEL__);
#endif
}

/// \param ours  what must be the same for a run to go on: the names of policies, the precision
/// \throws io_error if the state was made by other policies, in another precision or dimension
template <class S>
void check_same_policies(const State<S>& state, int dimension, const std::vector<StateAttribute>& ours) {
    if (state.dimension != dimension)
        throw io_error(
            sentence("The state has ", state.dimension, " dimensions, the run that is to go on ", dimension, "."));
    for (const StateAttribute& mine : ours) {
        const auto same = [&](const StateAttribute& a) { return a.name == mine.name; };
        const auto theirs = std::find_if(state.attributes.begin(), state.attributes.end(), same);
        const std::string found = theirs == state.attributes.end() ? "nothing" : "'" + theirs->value + "'";
        if (found != "'" + mine.value + "'")
            throw io_error(sentence("The state says ", found, " for ", mine.name, ", the run that is to go on uses '",
                                    mine.value, "'. Make it with the same policies and precision."));
    }
}

/// The values of a parameter that state_of() writes.
template <class S>
std::vector<double> parameter_values(const State<S>& state, const char* group, const char* name) {
    for (const StateParameter& p : state.parameters)
        if (p.group == group && p.name == name && !p.values.empty()) return p.values;
    throw io_error(sentence("The state does not say ", group, "/", name, "; it was not written by state_of()."));
}

inline const StateTable& table(const std::vector<StateTable>& tables, const char* name, int columns) {
    for (const StateTable& t : tables)
        if (t.name == name && t.columns == columns) return t;
    throw io_error(sentence("The state has no table '", name, "' of ", columns,
                            " columns; it was not written by state_of() and cannot be continued."));
}

}  // namespace detail

/// Sets a policy's parameters to those of a state's group: boundaries that moved go back to where they were.
///
///     restore_parameters(simulation.boundary, state, "boundary");
///
/// \throws io_error if the state lacks one, or has another number of values for it; the policy is then as it was
template <class Policy, class S>
void restore_parameters(Policy& policy, const State<S>& state, const char* group) {
    Policy restored = policy;
    for_parameters(restored, [&](const std::string& name, const char*, auto& value) {
        const std::vector<double> values = detail::parameter_values(state, group, name.c_str());
        if (values.size() != detail::as_doubles(value).size())
            throw io_error(sentence("The state has ", values.size(), " values for ", group, "/", name,
                                    "; the simulation's policy needs ", detail::as_doubles(value).size(), "."));
        using Value = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_arithmetic_v<Value>)
            value = Value(values[0]);
        else
            for (std::size_t i = 0; i < values.size(); ++i)
                value[int(i)] = std::remove_cvref_t<decltype(value[0])>(values[i]);
    });
    policy = restored;
}

}  // namespace firn
