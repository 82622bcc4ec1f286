/// \file Parts that the states of all kinds of runs share: parameters, tables, and the build that wrote them.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/io/state.hpp>
#include <firn/version.hpp>

#include <algorithm>
#include <string>
#include <type_traits>
#include <vector>

namespace firn {

/// The states that a run may go on from.
enum class Restart {
    same_bits,    ///< A state of the same run and build. Each further step gives the bits of the run that wrote it.
    other_build,  ///< Also a state that another compiler, processor or version of firn wrote. Rounding may differ.
    converted     ///< A state of any run, in any precision, whose particles have the fields that the material needs.
};

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

template <state_scalar S>
inline constexpr const char* precision_name = sizeof(S) == 4 ? "float" : "double";

inline std::string compiler_name() {
#if defined(__clang__)
    return sentence("clang ", __clang_major__, ".", __clang_minor__, ".", __clang_patchlevel__);
#else
    return sentence("g++ ", __GNUC__, ".", __GNUC_MINOR__, ".", __GNUC_PATCHLEVEL__);
#endif
}

/// The instruction set that the program is compiled for. Fused multiplications and additions round differently.
inline std::string instruction_set() {
    std::string name =
#if defined(__x86_64__)
        "x86-64";
#elif defined(__aarch64__)
        "aarch64";
#else
        "another processor";
#endif
#if defined(__AVX512F__)
    name += " avx512";
#elif defined(__AVX2__)
    name += " avx2";
#elif defined(__AVX__)
    name += " avx";
#endif
#ifdef __FMA__
    name += " fma";
#endif
#ifndef __OPTIMIZE__
    name += ", not optimised";
#endif
    return name;
}

/// Attributes that must also be equal for a run to go on with the same bits.
inline std::vector<StateAttribute> build_attributes() {
    return {{"library_version", version()}, {"compiler", compiler_name()}, {"instruction_set", instruction_set()}};
}

/// \throws io_error  if the state has another number of dimensions
template <class S>
void check_dimension(const State<S>& state, int dimension) {
    if (state.dimension != dimension)
        throw io_error(sentence("The state has ", state.dimension, " dimensions, this run has ", dimension, "."));
}

/// \throws io_error  if one of these attributes is missing in the state or has another value
template <class S>
void check_same(const State<S>& state, const std::vector<StateAttribute>& ours, const char* advice) {
    for (const StateAttribute& mine : ours) {
        const auto same = [&](const StateAttribute& a) { return a.name == mine.name; };
        const auto theirs = std::find_if(state.attributes.begin(), state.attributes.end(), same);
        const std::string found = theirs == state.attributes.end() ? "nothing" : "'" + theirs->value + "'";
        if (found != "'" + mine.value + "'")
            throw io_error(
                sentence("The state says ", found, " for ", mine.name, "; this run has '", mine.value, "'. ", advice));
    }
}

/// \throws io_error  if another build wrote the state
template <class S>
void check_same_build(const State<S>& state) {
    check_same(state, build_attributes(),
               "Another build rounds differently. If this is acceptable, use Restart::other_build.");
}

/// Returns the values of a parameter that state_of() writes.
/// \throws io_error  if the state has no such parameter
template <class S>
std::vector<double> parameter_values(const State<S>& state, const char* group, const char* name) {
    for (const StateParameter& p : state.parameters)
        if (p.group == group && p.name == name && !p.values.empty()) return p.values;
    throw io_error(sentence("The state has no parameter ", group, "/", name, "; it was not written by state_of()."));
}

inline const StateTable& table(const std::vector<StateTable>& tables, const char* name, int columns) {
    for (const StateTable& t : tables)
        if (t.name == name && t.columns == columns) return t;
    throw io_error(sentence("The state has no table '", name, "' of ", columns,
                            " columns; it was not written by state_of(), and no run can go on from it."));
}

}  // namespace detail

/// Sets a policy's parameters to those in a group of a state. A moving boundary, for example, returns to its place:
///
///     restore_parameters(simulation.boundary, state, "boundary");
///
/// \throws io_error  if the state lacks a parameter, has another number of values for it, or has a value that is not
///                   finite or 1e300 or more; the policy then does not change
template <class Policy, state_scalar S>
void restore_parameters(Policy& policy, const State<S>& state, const char* group) {
    Policy restored = policy;
    for_parameters(restored, [&](const std::string& name, const char*, auto& value) {
        const std::vector<double> values = detail::parameter_values(state, group, name.c_str());
        if (values.size() != detail::as_doubles(value).size())
            throw io_error(sentence("The state has ", values.size(), " values for ", group, "/", name,
                                    "; the simulation's policy needs ", detail::as_doubles(value).size(), "."));
        for (const double number : values)
            if (!(std::abs(number) < 1e300))
                throw io_error(
                    sentence("The state says ", number, " for ", group, "/", name, "; the file is damaged."));
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
