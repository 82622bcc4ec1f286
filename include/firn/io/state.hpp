/// \file The state of a run at one time, as arrays with names and units. A state can have everything that is needed to
/// continue the run, or to examine the results of the run. The type of a state depends neither on the type of the
/// simulation nor on the file format.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// The type of the values in a state's fields: float or double.
template <class S>
concept state_scalar = std::same_as<S, float> || std::same_as<S, double>;

/// A field of a state: one quantity, such as the velocity, with a value for every particle.
template <state_scalar S>
struct StateField {
    std::string name;    ///< Name of the field, without `/`, `.` and control characters.
    std::string unit;    ///< Unit, such as "m/s"; "1" if the quantity has no unit.
    int components = 1;  ///< Number of values per particle: 1 for a scalar, D (2 or 3) for a vector, D·D for a matrix.
    /// The values, particle by particle, in the order of State::id. A matrix is stored row by row.
    std::vector<S> values;

    bool operator==(const StateField&) const = default;
};

/// A parameter of the run. The values are exact even if the parameter has type float, because every float is also a
/// double.
struct StateParameter {
    std::string group;           ///< The part of the run that has the parameter: "material", "grid", "boundary", …
    std::string name;            ///< Name of the parameter, unique in the group.
    std::string unit;            ///< Unit, such as "Pa"; "1" if the parameter has no unit.
    std::vector<double> values;  ///< One value for a scalar, D (2 or 3) values for a vector.

    bool operator==(const StateParameter&) const = default;
};

/// A text that describes the run: the name of the kernel, transfer, material, compiler, …
struct StateAttribute {
    std::string name;   ///< Name of the attribute, such as "kernel".
    std::string value;  ///< Text of the attribute, such as "quadratic_b_spline".

    bool operator==(const StateAttribute&) const = default;
};

/// A table of integers in a state, such as the slot of each particle.
struct StateTable {
    std::string name;                  ///< Name of the table, without `/`, `.` and control characters.
    int columns = 1;                   ///< Number of columns.
    std::vector<std::int64_t> values;  ///< The integers, row by row.

    bool operator==(const StateTable&) const = default;
};

/// The state of the particles of a run, or of the points of a ParticleSystem, at one time.
/// \tparam S  precision of the fields, float or double
template <state_scalar S>
struct State {
    using Scalar = S;  ///< Precision of the fields.

    int dimension = 3;                  ///< Number of dimensions D, 2 or 3.
    std::uint64_t step = 0;             ///< Number of steps since the start of the run.
    double time = 0;                    ///< Time [s].
    double last_time_step = 0;          ///< Size of the last time step [s]; 0 before the first step.
    std::vector<StateField<S>> fields;  ///< The fields. A field "position" [m] with D components is required.
    std::vector<std::int64_t> id;       ///< The id of each particle or point.
    std::vector<std::int32_t> body;     ///< Index (from 0) of each particle's body; or the group of each point.
    std::vector<StateParameter>
        parameters;  ///< Parameters of the run. read_state() returns up to 512 of them by group.
    std::vector<StateAttribute> attributes;  ///< Texts that describe the run.
    std::vector<StateTable> tables;          ///< Tables of integers, such as the slot of each particle.
    /// Facets: triangles in 3D, edges in 2D. Each facet has D elements in this array: the indices (from 0, into `id`)
    /// of the points at the facet's corners.
    std::vector<std::int64_t> facets;

    bool operator==(const State&) const = default;

    /// Returns the number of particles.
    std::size_t size() const { return id.size(); }

    /// Returns the field with this name, or nullptr if the state has no such field.
    const StateField<S>* find(std::string_view name) const {
        for (const auto& field : fields) {
            if (field.name == name) return &field;
        }
        return nullptr;
    }

    /// Returns the field with this name.
    /// \throws parameter_error  if there is no such field; the message lists the names of all fields
    const StateField<S>& field(std::string_view name) const {
        if (const auto* found = find(name)) return *found;
        std::string names;
        for (const auto& field : fields) names += (names.empty() ? "" : ", ") + field.name;
        throw parameter_error(
            sentence("The state has no field '", name, "'; it has: ", names.empty() ? "none" : names, "."));
    }
};

namespace detail {

inline constexpr std::size_t max_state_name = 200;
/// The maximum length of a unit [bytes], and of a text that is an attribute of the file; a longer text of a state is a
/// dataset. HDF5 stores an attribute in the header of an object, which must be smaller than 64 KiB.
inline constexpr std::size_t max_state_text = 32768;
/// The maximum number of members of a group in a state's file; also the maximum number of a group's attributes.
inline constexpr std::size_t max_state_members = 4096;
/// The maximum number of a state's parameters, so that a small file that is damaged does not ask for much memory.
inline constexpr std::size_t max_state_parameters = std::size_t(1) << 22;

inline void check_state_name(std::string_view kind, std::string_view name) {
    bool good = !name.empty() && name.size() <= max_state_name;
    for (const char c : name) good = good && c != '/' && c != '.' && c != '\x7f' && static_cast<unsigned char>(c) >= 32;
    if (!good) {
        throw parameter_error(sentence("The name of a ", kind, " is '", name, "'; give 1 to ", max_state_name,
                                       " characters without '/', '.' and control characters."));
    }
}

inline void check_state_unit(std::string_view owner, std::string_view text) {
    if (text.size() > max_state_text || text.find('\0') != std::string_view::npos) {
        throw parameter_error(sentence("The unit of '", owner, "' has ", text.size(), " bytes; give at most ",
                                       max_state_text, " and no zero byte."));
    }
}

/// Checks that there are not too many items, and that all have different names, because a file cannot contain two items
/// of the same name.
/// \param kind     what the items are, for the message
/// \param name_of  returns the name of an item
/// \param most     how many items a state can have
/// \throws parameter_error  if there are more, or if two names are equal
template <class Items, class Name>
void check_distinct(std::string_view kind, const Items& items, const Name& name_of, std::size_t most) {
    if (items.size() > most)
        throw parameter_error(sentence("The state has ", items.size(), " ", kind, "s; give at most ", most, "."));
    std::vector<std::string> names;
    names.reserve(items.size());
    for (const auto& item : items) names.push_back(name_of(item));
    std::sort(names.begin(), names.end());
    if (const auto twice = std::adjacent_find(names.begin(), names.end()); twice != names.end())
        throw parameter_error(sentence("The state has two ", kind, "s of the name '", *twice, "'; rename one."));
}

template <state_scalar S>
void check_state_field(const State<S>& state, const StateField<S>& field) {
    check_state_name("field", field.name);
    check_state_unit(field.name, field.unit);
    if (field.name == "id" || field.name == "body") {
        throw parameter_error(sentence("A field is named '", field.name, "', which State::", field.name,
                                       " holds as integers; rename the field."));
    }
    if (field.components < 1 || field.components > 1024) {
        throw parameter_error(
            sentence("The field '", field.name, "' has ", field.components, " components; give 1 to 1024."));
    }
    if (field.values.size() != state.size() * std::size_t(field.components)) {
        throw parameter_error(sentence("The field '", field.name, "' has ", field.values.size(), " values; ",
                                       state.size(), " particles × ", field.components, " components need ",
                                       state.size() * std::size_t(field.components), "."));
    }
}

}  // namespace detail

/// Checks whether the parts of a state fit together: the sizes of the arrays must match, names and units must not be
/// too long, there must not be too many parts, texts must not have forbidden characters, names must be unique, times
/// must be finite, and the corners of facets must exist. The values of fields are not checked, so that a state with NaN
/// can be written and examined.
/// \throws parameter_error  if one of these checks fails; the message says which check failed
template <state_scalar S>
void check_state(const State<S>& state) {
    if (state.dimension != 2 && state.dimension != 3) {
        throw parameter_error(sentence("The state has ", state.dimension, " dimensions; firn knows 2 and 3."));
    }
    if (!std::isfinite(state.time) || !std::isfinite(state.last_time_step) || state.last_time_step < 0) {
        throw parameter_error(sentence("The state has time = ", state.time,
                                       " s and last_time_step = ", state.last_time_step,
                                       " s; both must be finite, and last_time_step must not be negative."));
    }
    if (state.body.size() != state.size()) {
        throw parameter_error(sentence("The state has ", state.size(), " ids and ", state.body.size(),
                                       " body numbers; give one of each for every particle."));
    }
    for (const auto& field : state.fields) detail::check_state_field(state, field);
    // Beside the fields but the position, the file has `id` and `body`; beside the attributes, three of its own.
    constexpr std::size_t most = detail::max_state_members;
    detail::check_distinct("field", state.fields, [](const auto& f) { return f.name; }, most - 1);
    if (const auto& position = state.field("position"); position.components != state.dimension) {
        throw parameter_error(sentence("The field 'position' has ", position.components, " components in ",
                                       state.dimension, " dimensions; give one component per dimension."));
    }
    for (const auto& parameter : state.parameters) {
        detail::check_state_name("parameter's group", parameter.group);
        detail::check_state_name("parameter", parameter.name);
        detail::check_state_unit(parameter.name, parameter.unit);
        if (parameter.values.empty() || parameter.values.size() > 4096) {
            throw parameter_error(sentence("The parameter '", parameter.name, "' has ", parameter.values.size(),
                                           " values; give 1 to 4096."));
        }
    }
    for (const auto& table : state.tables) {
        detail::check_state_name("table", table.name);
        if (table.columns < 1 || table.columns > 1024 || table.values.size() % std::size_t(table.columns) != 0) {
            throw parameter_error(sentence("The table '", table.name, "' has ", table.values.size(), " values in ",
                                           table.columns, " columns; give whole rows of 1 to 1024 columns."));
        }
    }
    if (state.facets.size() % std::size_t(state.dimension) != 0) {
        throw parameter_error(sentence("The facets of the state are ", state.facets.size(), " point numbers; give ",
                                       state.dimension, " for each facet."));
    }
    for (const auto point : state.facets) {
        if (point < 0 || std::uint64_t(point) >= state.size()) {
            throw parameter_error(sentence("A facet of the state names point ", point, ", but there are ", state.size(),
                                           ", counted from 0."));
        }
    }
    detail::check_distinct("table", state.tables, [](const auto& t) { return t.name; }, most);
    detail::check_distinct(
        "parameter", state.parameters, [](const auto& p) { return p.group + "/" + p.name; },
        detail::max_state_parameters);
    for (const auto& attribute : state.attributes) {
        detail::check_state_name("attribute", attribute.name);
        if (attribute.value.find('\0') != std::string::npos)
            throw parameter_error(sentence("The text of '", attribute.name, "' has ", attribute.value.size(),
                                           " bytes, of which one is zero; give a text without zero bytes."));
        if (attribute.name == "schema_version" || attribute.name == "dimension" || attribute.name == "digest") {
            throw parameter_error(
                sentence("An attribute is named '", attribute.name, "', which the file uses itself; rename it."));
        }
    }
    detail::check_distinct("attribute", state.attributes, [](const auto& a) { return a.name; }, most - 3);
}

}  // namespace firn::inline FIRN_BUILD
