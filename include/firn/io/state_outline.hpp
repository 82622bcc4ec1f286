/// \file The outline of a state: its names, texts and few numbers, and for each of its arrays either the numbers or
/// only how many there are. Files and digests of states are made from outlines, so that the arrays of a state may be
/// spread over several processes.
#pragma once

#include <firn/io/state.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// The kinds of numbers in a state's arrays: float, double, std::uint8_t, std::int32_t, std::int64_t, std::uint64_t.
enum class NumberKind : std::uint8_t { f32, f64, u8, i32, i64, u64 };

template <class T>
constexpr NumberKind number_kind() {
    constexpr bool is_signed = std::signed_integral<T>;
    if constexpr (std::floating_point<T>) return sizeof(T) == 4 ? NumberKind::f32 : NumberKind::f64;
    if constexpr (sizeof(T) == 8) return is_signed ? NumberKind::i64 : NumberKind::u64;
    static_assert(std::floating_point<T> || sizeof(T) == 8 || sizeof(T) == (is_signed ? 4 : 1));
    return is_signed ? NumberKind::i32 : NumberKind::u8;
}

/// Returns the size of one number [bytes].
constexpr std::size_t bytes_of(NumberKind kind) {
    switch (kind) {
        case NumberKind::u8:
            return 1;
        case NumberKind::f32:
        case NumberKind::i32:
            return 4;
        default:
            return 8;
    }
}

/// An array of a state, of numbers of any kind, so that files and digests are made by code that is compiled once. The
/// array is here, in this process's memory, or elsewhere; of an array that is elsewhere only the number of its numbers
/// is known, and their hash once somebody has computed it. An array without numbers is here.
struct StateArray {
    NumberKind kind = NumberKind::i64;
    std::size_t count = 0;          ///< number of the array's numbers
    const void* numbers = nullptr;  ///< the numbers; nullptr if they are elsewhere
    std::uint64_t hash = 0;         ///< hash_numbers() of an array that is elsewhere

    StateArray() = default;
    /// An array that is here, or, with nullptr, elsewhere. One that is here must exist as long as this object.
    StateArray(NumberKind of, std::size_t many, const void* here) : kind(of), count(many), numbers(here) {}
    template <class T>
    StateArray(std::span<const T> here) : StateArray(number_kind<T>(), here.size(), here.data()) {}
    template <class T>
    StateArray(const std::vector<T>& here) : StateArray(std::span<const T>(here)) {}

    /// Makes this an array of so many numbers that is elsewhere.
    void move_elsewhere(std::size_t many) {
        count = many;
        numbers = nullptr;
    }
    bool is_here() const { return numbers || count == 0; }
    /// The bytes of an array that is here; of another, no bytes.
    std::span<const std::byte> bytes() const {
        return {static_cast<const std::byte*>(numbers), numbers ? count * bytes_of(kind) : 0};
    }
};

/// Returns whether the rows of a table are spread over the processes like the particles: the slot of each particle, and
/// the blocks of particles. Every process has the whole of all other tables.
inline bool is_spread_table(std::string_view name) { return name == "slot" || name == "blocks"; }

/// The outline of a state. It refers to the state, which must exist as long as the outline.
struct StateOutline {
    struct Field {
        std::string_view name, unit;
        int components;
        StateArray values;
    };
    struct Table {
        std::string_view name;
        int columns;
        StateArray values;
    };

    NumberKind scalar;  // of the fields
    int dimension;
    std::uint64_t step;
    double time, last_time_step;
    std::vector<Field> fields;
    StateArray id;
    StateArray body;
    std::vector<Table> tables;
    std::span<const std::int64_t> facets;  // always here
    std::span<const StateParameter> parameters;
    std::span<const StateAttribute> attributes;

    /// The outline of a state with all its arrays.
    template <state_scalar S>
    explicit StateOutline(const State<S>& state)
        : scalar(number_kind<S>()),
          dimension(state.dimension),
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

}  // namespace firn::inline FIRN_BUILD::detail
