/// \file Bodies of pass.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/core/error.hpp>
#include <firn/simulation/pass.hpp>

#include <algorithm>

namespace firn::inline FIRN_BUILD {

namespace detail {
/// Returns the name of the first of some data of a step.
inline const char* name_of_data(Data data) {
    constexpr std::pair<Data, const char*> names[] = {
        {Data::momenta, "the momenta of nodes"},
        {Data::node_velocities, "the velocities of nodes"},
        {Data::velocities_before_forces, "the velocities of nodes before forces act"},
        {Data::averages, "averages of rates of volume change"},
        {Data::gaps, "the gaps at walls"},
        {Data::node_loads, "the loads on nodes"}};
    for (const auto& [one, name] : names)
        if ((data & one) != Data::none) return name;
    return "nothing";
}
}  // namespace detail

template <std::floating_point S, int D>
[[gnu::cold]] void PassList<S, D>::add(Pass<S, D> pass, std::string_view after) {
    const auto named = [&](std::string_view name) {
        return std::ranges::find_if(passes_, [&](const Pass<S, D>& one) { return one.name == name; });
    };
    if (pass.name.empty() || !pass.act) throw parameter_error("A pass has a name, and a function that does its work.");
    if (named(pass.name) != passes_.end())
        throw parameter_error(sentence("There is a pass '", pass.name, "' already: give this one another name."));
    auto at = passes_.end();
    if (!after.empty()) {
        at = named(after);
        if (at == passes_.end()) {
            std::string all;
            for (const Pass<S, D>& one : passes_) all += (all.empty() ? "'" : ", '") + one.name + "'";
            throw parameter_error(sentence("There is no pass '", after, "' in this simulation. It has ", all, "."));
        }
        pass.each_set = pass.each_set && at->each_set;
        ++at;
        while (!pass.each_set && at != passes_.end() && at->each_set && (at - 1)->each_set) ++at;
    }
    at = passes_.insert(at, std::move(pass));
    const std::string wrong = what_is_missing();
    if (wrong.empty()) return;
    passes_.erase(at);
    throw parameter_error(wrong);
}

template <std::floating_point S, int D>
[[gnu::cold]] std::string PassList<S, D>::what_is_missing() const {
    Data written = Data::none;
    for (const Pass<S, D>& pass : passes_) {
        const Data missing = Data(std::uint32_t(pass.reads & data_of_a_step) & ~std::uint32_t(written));
        if (missing != Data::none)
            return sentence("The pass '", pass.name, "' reads ", detail::name_of_data(missing),
                            ", which no pass before it writes.");
        written = written | pass.writes;
        if ((pass.writes & Data::momenta) != Data::none)  // the same numbers hold the one or the other
            written = Data(std::uint32_t(written) & ~std::uint32_t(Data::node_velocities));
    }
    return {};
}

}  // namespace firn::inline FIRN_BUILD
