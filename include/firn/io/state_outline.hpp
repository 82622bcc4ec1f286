/// \file The outline of a state: its names, texts and few numbers, and for each of its arrays either the numbers or
/// only how many there are. Files and digests of states are made from outlines, so that the arrays of a state may be
/// spread over several processes.
#pragma once

#include <firn/io/state.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace firn::detail {

/// An array of a state. It is here, in this process's memory, or elsewhere; of an array that is elsewhere only the
/// number of its numbers is known, and their hash once somebody has computed it. An array without numbers is here.
template <class T>
struct StateArray {
    std::size_t count = 0;       ///< number of the array's numbers
    const T* numbers = nullptr;  ///< the numbers; nullptr if they are elsewhere
    std::uint64_t hash = 0;      ///< hash_numbers() of an array that is elsewhere

    StateArray() = default;
    /// An array that is elsewhere.
    explicit StateArray(std::size_t numbers_elsewhere) : count(numbers_elsewhere) {}
    /// An array that is here. It must exist as long as this object.
    StateArray(std::span<const T> here) : count(here.size()), numbers(here.data()) {}
    StateArray(const std::vector<T>& here) : StateArray(std::span<const T>(here)) {}

    bool is_here() const { return numbers || count == 0; }
    std::span<const T> span() const { return numbers ? std::span(numbers, count) : std::span<const T>(); }
};

/// Returns whether the rows of a table are spread over the processes like the particles: the slot of each particle, and
/// the blocks of particles. Every process has the whole of all other tables.
inline bool is_spread_table(std::string_view name) { return name == "slot" || name == "blocks"; }

/// The outline of a state. It refers to the state, which must exist as long as the outline.
template <state_scalar S>
struct StateOutline {
    struct Field {
        std::string_view name, unit;
        int components;
        StateArray<S> values;
    };
    struct Table {
        std::string_view name;
        int columns;
        StateArray<std::int64_t> values;
    };

    int dimension;
    std::uint64_t step;
    double time, last_time_step;
    std::vector<Field> fields;
    StateArray<std::int64_t> id;
    StateArray<std::int32_t> body;
    std::vector<Table> tables;
    StateArray<std::int64_t> facets;  // always here
    std::span<const StateParameter> parameters;
    std::span<const StateAttribute> attributes;

    /// The outline of a state with all its arrays.
    explicit StateOutline(const State<S>& state)
        : dimension(state.dimension),
          step(state.step),
          time(state.time),
          last_time_step(state.last_time_step),
          id(state.id),
          body(state.body),
          facets(state.facets),
          parameters(state.parameters),
          attributes(state.attributes) {
        for (const StateField<S>& f : state.fields) fields.push_back({f.name, f.unit, f.components, f.values});
        for (const StateTable& t : state.tables) tables.push_back({t.name, t.columns, t.values});
    }

    /// Number of particles or points.
    std::size_t points() const { return id.count; }
};

}  // namespace firn::detail
