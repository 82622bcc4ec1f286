/// \file Functions for the states of both Simulation and ParticleSystem. They compare the attributes of a state with
/// those of a run, and read the parameters and tables of a state.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/io/state.hpp>
#include <firn/version.hpp>

#include <algorithm>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Which states restore() accepts.
enum class Restart {
    /// Accept only a state that was written by the same build (compiler, instruction set, version of firn), in a run
    /// with the same policies and parameters. The continued run then gives the same bits as an uninterrupted run.
    ///
    /// What shapes a run and is no parameter is compared, too: numbers such as the friction of walls with all of their
    /// digits, and data such as the distances of a DistanceGrid by a digest. Of your own policies, data are compared if
    /// they have digest(), see core/digest.hpp. Functions (loads, forces, acceleration fields) cannot be compared. A
    /// state of schema_version 4 or earlier says nothing of all this, except for nine digits of numbers.
    same_bits,
    /// Accept also a state that was written by another build, in a run with the same policies and parameters. The
    /// continued run may then round differently. Numbers that are no parameters are compared by nine digits; digests
    /// are not compared, since another build may compute other distances from the same mesh.
    other_build,
    /// Accept a state of any run and any precision, if the state has all fields that the material of the simulation
    /// needs.
    converted
};

namespace detail {

/// Returns a number, or several numbers in parentheses, with all of their digits.
[[gnu::cold]] inline std::string numbers_text(const std::vector<double>& numbers) {
    if (numbers.size() == 1) return exact_text(numbers[0]);
    std::string text;
    for (const double number : numbers) text += (text.empty() ? "(" : ", ") + exact_text(number);
    return text + ")";
}

template <state_scalar S>
inline constexpr const char* precision_name = sizeof(S) == 4 ? "float" : "double";

[[gnu::cold]] inline std::string compiler_name() {
#if defined(__clang__)
    return sentence("clang ", __clang_major__, ".", __clang_minor__, ".", __clang_patchlevel__);
#else
    return sentence("g++ ", __GNUC__, ".", __GNUC_MINOR__, ".", __GNUC_PATCHLEVEL__);
#endif
}

/// Returns the name of the instruction set for which the program is compiled, such as "x86-64 avx2 fma". The name ends
/// with ", not optimised" if the compiler does not optimise. The instruction set can change rounding, because a fused
/// multiply-add rounds once instead of twice.
[[gnu::cold]] inline std::string instruction_set() {
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

/// Returns the attributes that describe the build: version of firn, compiler and instruction set. Restart::same_bits
/// only accepts a state with the same values of these attributes.
[[gnu::cold]] inline std::vector<StateAttribute> build_attributes() {
    return {{"library_version", version()}, {"compiler", compiler_name()}, {"instruction_set", instruction_set()}};
}

/// Checks that the number of dimensions of the state is `dimension`.
/// \throws io_error  if the state has another number of dimensions
template <class S>
[[gnu::cold]] void check_dimension(const State<S>& state, int dimension) {
    if (state.dimension != dimension)
        throw io_error(sentence("The state has ", state.dimension, " dimensions, this run has ", dimension, "."));
}

/// Returns the first items in which two lists of items, separated by "; ", differ. A list that has ended has empty
/// ones.
/// \param one, other  the lists; afterwards what follows these items
[[gnu::cold]] inline std::pair<std::string_view, std::string_view> first_unequal_items(std::string_view& one,
                                                                                       std::string_view& other) {
    const auto next = [](std::string_view& list) {
        const std::size_t end = std::min(list.find("; "), list.size());
        const std::string_view item = list.substr(0, end);
        list.remove_prefix(std::min(end + 2, list.size()));
        return item;
    };
    std::string_view a, b;
    do {
        a = next(one);
        b = next(other);
    } while (a == b && !(one.empty() && other.empty()));
    return {a, b};
}

/// Checks that the state has all attributes in `ours`, with the same values. Of long values, the message shows the
/// first items that differ.
/// \param ours    attributes of the run
/// \param advice  last sentence of the error's message
/// \throws io_error  if the state lacks one of these attributes, or if the state has another value for one of them
template <class S>
[[gnu::cold]] void check_same(const State<S>& state, const std::vector<StateAttribute>& ours, const char* advice) {
    for (const StateAttribute& mine : ours) {
        const auto same = [&](const StateAttribute& a) { return a.name == mine.name; };
        const auto theirs = std::find_if(state.attributes.begin(), state.attributes.end(), same);
        const bool is_there = theirs != state.attributes.end();
        if (is_there && theirs->value == mine.value) continue;
        std::string_view found = is_there ? std::string_view(theirs->value) : "", own = mine.value;
        constexpr std::size_t readable = 1000;
        if (is_there && std::max(found.size(), own.size()) > readable)
            std::tie(found, own) = first_unequal_items(found, own);
        const auto said = [](std::string_view text) { return text.empty() ? "nothing" : sentence("'", text, "'"); };
        throw io_error(
            sentence("The state says ", said(found), " for ", mine.name, "; this run has ", said(own), ". ", advice));
    }
}

/// Checks that the state was written by the same build as this program.
/// \throws io_error  if the state was written with another compiler, instruction set or version of firn
template <class S>
[[gnu::cold]] void check_same_build(const State<S>& state) {
    check_same(state, build_attributes(),
               "Another build rounds differently. If this is acceptable, use Restart::other_build.");
}

[[noreturn]] inline void throw_no_parameter(std::string_view group, std::string_view name) {
    throw io_error(sentence("The state has no parameter ", group, "/", name, "; it was not written by state_of()."));
}

/// Returns the values of the parameter `name` in the group `group` of a state.
/// \throws io_error  if the state has no such parameter
template <class S>
[[gnu::cold]] std::vector<double> parameter_values(const State<S>& state, const char* group, const char* name) {
    for (const StateParameter& p : state.parameters)
        if (p.group == group && p.name == name && !p.values.empty()) return p.values;
    throw_no_parameter(group, name);
}

template <class S>
[[gnu::cold]] bool has_parameter(const State<S>& state, const char* group, const char* name) {
    return std::ranges::any_of(state.parameters, [&](const auto& p) { return p.group == group && p.name == name; });
}

[[gnu::cold]] inline const StateTable& table(const std::vector<StateTable>& tables, const char* name, int columns) {
    for (const StateTable& t : tables)
        if (t.name == name && t.columns == columns) return t;
    throw io_error(sentence("The state has no table '", name, "' of ", columns,
                            " columns; it was not written by state_of(), and no run can go on from it."));
}

}  // namespace detail

/// Sets the parameters of a policy to the values in a state. For example, this sets a moving boundary to its position
/// in the state:
///
///     restore_parameters(simulation.boundary, state, "boundary");
///
/// \param policy  a boundary, a transfer or a volumetric policy
/// \param group   the group of the state's parameters, "boundary", "transfer" or "volumetric"
/// \throws io_error  if the state lacks a parameter of the policy, if a parameter has another number of values in the
///                   state than in the policy, or if a value is NaN or has a magnitude of at least 1e300; the policy is
///                   then unchanged
template <class Policy, state_scalar S>
[[gnu::cold]] void restore_parameters(Policy& policy, const State<S>& state, const char* group) {
    const std::vector<StateParameter>& all = state.parameters;
    std::size_t next = 0;  // where to look first: a list of colliders has very many, in the order of the policy
    Policy restored = policy;
    for_parameters(restored, [&](const std::string& name, const char*, auto& value) {
        const auto is_it = [&](const StateParameter& p) { return p.group == group && p.name == name; };
        std::size_t tried = 0;
        for (; tried < all.size() && !is_it(all[next % all.size()]); ++tried) ++next;
        if (tried == all.size()) detail::throw_no_parameter(group, name);
        const std::vector<double>& values = all[next++ % all.size()].values;
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

}  // namespace firn::inline FIRN_BUILD
