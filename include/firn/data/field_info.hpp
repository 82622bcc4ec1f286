/// \file The description of a field of particles: its name, unit, shape, role and start.
///
/// Sorting, growing, states, restart and the GPU's layout are loops over a table of these descriptions.
#pragma once

#include <firn/core/tensor.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace firn {

/// Numbers in a symmetric D × D matrix, stored as the upper triangle by rows: 00 01 02 11 12 22.
template <int D>
inline constexpr int symmetric_size = D * (D + 1) / 2;

/// \name Upper triangle
/// @{

/// The index of element (i, j) of a symmetric d × d matrix in its upper triangle.
FIRN_INLINE constexpr int symmetric_index(int d, int i, int j) {
    const int low = i < j ? i : j, high = i < j ? j : i;
    return low * (2 * d - low - 1) / 2 + high;
}
template <int D>
FIRN_INLINE constexpr int symmetric_index(int i, int j) {
    return symmetric_index(D, i, j);
}
/// @}

/// The shape of a field in D dimensions: one number, D numbers, a D × D matrix, or its upper triangle.
enum class FieldShape : std::uint8_t { scalar, vector, matrix, symmetric_matrix };

/// The type of a field's numbers. `real` is the precision of the particles.
enum class FieldNumber : std::uint8_t { real, uint32, float64 };

/// Who writes a field.
enum class FieldRole : std::uint8_t {
    motion,    ///< every step writes it
    affine,    ///< affine transfers; with other transfers it stays at its start, and a state may lack it
    stress,    ///< G2P, for the next P2G; it follows from the material's state
    given,     ///< the program, when it adds the particle; no step changes it
    constant,  ///< nobody, unless the program does; by default it is at its start
    state      ///< the material
};

/// Which numbers of a stored field are valid when a run is continued.
enum class FieldRange : std::uint8_t { finite, not_negative, positive };

/// The description of a field: a line of the table.
struct FieldInfo {
    const char* name;  ///< its name in states and GPU programs
    const char* unit;  ///< such as "m/s"
    FieldShape shape;  ///< scalar, vector or matrix
    FieldRole role;    ///< who writes it
    /// The numbers of a new particle and of padding; a matrix column by column.
    std::array<double, 9> start{};
    FieldRange range = FieldRange::finite;   ///< valid numbers
    FieldNumber number = FieldNumber::real;  ///< type of its numbers

    /// True if a finite number is in the field's range.
    constexpr bool allows(double value) const {
        return range == FieldRange::positive ? value > 0 : range == FieldRange::finite || value >= 0;
    }
    /// Numbers per particle in d dimensions, as stored.
    constexpr int components(int d) const {
        switch (shape) {
            case FieldShape::scalar:
                return 1;
            case FieldShape::vector:
                return d;
            case FieldShape::matrix:
                return d * d;
            case FieldShape::symmetric_matrix:
                return d * (d + 1) / 2;
        }
        return 0;
    }
    /// Numbers per particle in a state, where a symmetric matrix is whole.
    constexpr int components_in_state(int d) const {
        return shape == FieldShape::symmetric_matrix ? d * d : components(d);
    }
    /// The index among the stored numbers of number k in a state, where matrices lie row by row.
    constexpr int component_of(int d, int k) const {
        switch (shape) {
            case FieldShape::matrix:
                return k % d * d + k / d;
            case FieldShape::symmetric_matrix:
                return symmetric_index(d, k / d, k % d);
            default:
                return k;
        }
    }
};

/// A particle's fields, a line each.
using FieldTable = std::vector<FieldInfo>;

/// A start with the same number for every component.
constexpr std::array<double, 9> everywhere(double number) {
    std::array<double, 9> all{};
    all.fill(number);
    return all;
}

}  // namespace firn
