/// \file What shapes a run besides the parameters in its states: numbers and choices in texts with all of their digits,
/// and digests of data. A restart to the same bits compares them.
#pragma once

#include <firn/core/digest.hpp>
#include <firn/core/names.hpp>
#include <firn/core/parameters.hpp>
#include <firn/io/state_parts.hpp>
#include <firn/simulation/source.hpp>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Attributes of a state: what shapes the run besides its parameters, and the sources and sinks of its set.
inline constexpr const char *settings_name = "settings", *sources_name = "sources_and_sinks";

[[gnu::cold]] inline std::string digest_text(std::uint64_t digest) {
    std::string text = "digest ";
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[digest >> shift & 15u];
    return text;
}

/// What shapes a run besides its parameters: a list of items, separated by "; ".
struct Settings {
    std::string text{};                 ///< the items
    std::vector<std::string> unseen{};  ///< policies with data of which nothing tells

    void add(const std::string& item) { text += text.empty() ? item : "; " + item; }

    /// Adds what a policy says of itself and of the policies among its parameters.
    /// \param path  the names of the parameters that lead to the policy, such as "boundary_1_shape"
    template <class P>
    void add(const std::string& path, const P& policy) {
        constexpr bool describes = requires { policy.description(true); };
        constexpr bool digests = requires { std::uint64_t(policy.digest()); };
        if constexpr (describes) add(path + ": " + policy.description(true));
        if constexpr (digests) add(sentence(path, ", ", name_of<P>(), ": ", digest_text(policy.digest())));
        if constexpr (is_list<P>) {
            add(sentence(path, ": ", policy.all.size(), " in the list"));
            for (std::size_t k = 0; k < policy.all.size(); ++k) add(sentence(path, "_", k), policy.all[k]);
        } else {
            bool has_none = true;
            if constexpr (has_parameters<P>)
                std::apply(
                    [&](const auto&... each) {
                        has_none = sizeof...(each) == 0;
                        [[maybe_unused]] const auto visit = [&](const auto& one) {
                            const auto& value = one.of(policy);
                            using Value = std::remove_cvref_t<decltype(value)>;
                            if constexpr (is_policy<Value>) add(path + "_" + one.name, value);
                        };
                        (visit(each), ...);
                    },
                    P::parameters());
            if (has_none && !describes && !digests && !std::is_empty_v<P>) unseen.push_back(path);
        }
    }

    /// Returns the items as an attribute of a state; if they are too many for an attribute, their digest.
    StateAttribute attribute(const char* name) const {
        if (text.empty()) return {name, "none"};
        if (text.size() <= max_state_text / 2) return {name, text};
        return {name, sentence(text.size(), " bytes of ", digest_text(Digest().add(text).value()))};
    }
};

/// Returns the sources and sinks of a set of particles.
template <int D>
[[gnu::cold]] Settings settings_of(const std::vector<Source<D>>& sources, const std::vector<Sink<D>>& sinks) {
    const auto vector = [](const Vec<double, D>& v) {
        std::string text;
        for (const double x : v.v) text += (text.empty() ? "(" : ", ") + exact_text(x);
        return text + ")";
    };
    Settings all;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const Source<D>& of = sources[i];
        all.add(sentence("source ", i, ": ", of.samples.positions.size(), " particles of ",
                         exact_text(of.samples.volume), " m^", D, " and ", exact_text(of.density), " kg/m^3 at ",
                         vector(of.velocity), " m/s, rate ", exact_text(of.rate), " 1/s from ", exact_text(of.start),
                         " s to ", exact_text(of.end), " s, lifespan ", exact_text(of.lifespan), " s, contact group ",
                         of.contact_group, ", positions of ", digest_text(Digest().add(of.samples.positions).value())));
    }
    for (std::size_t i = 0; i < sinks.size(); ++i)
        all.add(sentence("sink ", i, ": from ", vector(sinks[i].lower), " m to ", vector(sinks[i].upper), " m"));
    return all;
}

/// Returns the first item in which two lists of items differ, from each of them; an empty item if one list has none in
/// its place, but goes on as the other.
[[gnu::cold]] inline std::pair<std::string, std::string> first_difference(std::string_view one,
                                                                          std::string_view other) {
    const auto [a, b] = first_unequal_items(one, other);
    const auto is_in = [](std::string_view item, std::string_view list) {
        return item.empty() || sentence("; ", list, "; ").find(sentence("; ", item, "; ")) != std::string::npos;
    };
    if (is_in(a, other)) return {"", std::string(b)};
    if (is_in(b, one)) return {std::string(a), ""};
    return {std::string(a), std::string(b)};
}

/// Checks that a state has the same settings as this run. A state that says nothing of them is of an earlier version.
/// \throws io_error  if they differ; the message shows the first difference
template <class S>
[[gnu::cold]] void check_settings(const State<S>& state, const StateAttribute& ours, const char* advice) {
    for (const StateAttribute& theirs : state.attributes) {
        if (theirs.name != ours.name || theirs.value == ours.value) continue;
        const auto [there, here] = first_difference(theirs.value, ours.value);
        const auto said = [](const std::string& item) { return item.empty() ? "nothing" : "'" + item + "'"; };
        throw io_error(sentence("The state says ", said(there), " where this run says ", said(here), ". ", advice));
    }
}

/// Warns of each policy that has data of which nothing tells whether they are those of the run that wrote the state.
[[gnu::cold]] inline void warn_of_unseen(const Settings& settings,
                                         const std::function<void(const std::string&)>& warn) {
    for (const std::string& policy : settings.unseen)
        if (warn)
            warn(sentence("the ", policy,
                          " has data, but neither parameters nor a function digest(): restore() cannot "
                          "tell whether they are those of the run that wrote the state. See firn/core/digest.hpp."));
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
