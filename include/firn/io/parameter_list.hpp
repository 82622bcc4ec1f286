/// \file The parameters of a state as three arrays, for states of so many that a dataset for each would be slow: a list
/// of 10,000 colliders has 80,000 parameters.
#pragma once

#include <firn/io/state.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// How many parameters a state has at most if each has a dataset of its own.
inline constexpr std::size_t most_parameter_datasets = 512;

/// Names of what a state's file has for what does not fit elsewhere: parameters, and texts longer than an attribute.
inline constexpr const char *parameter_list_name = "parameter_list", *long_texts_name = "texts";

/// The parameters of a state as three arrays.
struct ParameterList {
    std::vector<std::uint8_t> texts{};  ///< Of each parameter the group, the name and the unit, a zero byte after each.
    std::vector<std::int64_t> counts{};  ///< Of each parameter the number of its values.
    std::vector<double> values{};        ///< The values, parameter by parameter.

    /// Lists parameters.
    static ParameterList of(std::span<const StateParameter> parameters) {
        ParameterList list;
        list.counts.reserve(parameters.size());
        for (const StateParameter& p : parameters) {
            for (const std::string* text : {&p.group, &p.name, &p.unit})
                list.texts.insert(list.texts.end(), text->c_str(), text->c_str() + text->size() + 1);
            list.counts.push_back(std::int64_t(p.values.size()));
            list.values.insert(list.values.end(), p.values.begin(), p.values.end());
        }
        return list;
    }

    /// Appends the parameters to `to`.
    /// \throws io_error  if the arrays contradict each other, or if there are too many parameters
    void append_to(std::vector<StateParameter>& to) const {
        if (counts.size() > max_state_parameters)
            throw io_error(
                sentence("it has ", counts.size(), " parameters; a state has at most ", max_state_parameters));
        std::string_view rest(reinterpret_cast<const char*>(texts.data()), texts.size());
        const auto next = [&rest] {
            const std::size_t end = rest.find('\0');
            if (end == rest.npos) throw_contradiction();
            const std::string text(rest.substr(0, end));
            rest.remove_prefix(end + 1);
            return text;
        };
        std::size_t at = 0;
        for (const std::int64_t count : counts) {
            if (count < 0 || std::uint64_t(count) > values.size() - at) throw_contradiction();
            const auto first = values.begin() + std::ptrdiff_t(at);
            std::string group = next(), name = next(), unit = next();
            to.push_back({std::move(group), std::move(name), std::move(unit), {first, first + count}});
            at += std::size_t(count);
        }
        if (!rest.empty() || at != values.size()) throw_contradiction();
    }

private:
    [[noreturn]] static void throw_contradiction() {
        throw io_error("the arrays of its parameter_list contradict each other");
    }
};

}  // namespace firn::inline FIRN_BUILD::detail
