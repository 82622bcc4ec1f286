/// \file The description of a field of particles: its name, unit, shape, role and start value.
///
/// All fields of a particle are described in one table. To sort particles, to reserve memory, to save and restore a
/// state, to restart a run, and to lay out fields on the GPU, firn loops over this table.
#pragma once

#include <firn/core/tensor.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD {

/// Number of stored components of a symmetric D × D matrix: the upper triangle, row by row (in 3D xx, xy, xz, yy, yz,
/// zz).
template <int D>
inline constexpr int symmetric_size = D * (D + 1) / 2;

/// \name Index in the upper triangle of a symmetric matrix
/// @{

/// Returns the index of element (i, j) of a symmetric d × d matrix whose upper triangle is stored row by row (xx, xy,
/// xz, yy, …). The elements (i, j) and (j, i) have the same index.
FIRN_INLINE constexpr int symmetric_index(int d, int i, int j) {
    const int low = i < j ? i : j, high = i < j ? j : i;
    return low * (2 * d - low - 1) / 2 + high;
}
template <int D>
FIRN_INLINE constexpr int symmetric_index(int i, int j) {
    return symmetric_index(D, i, j);
}
/// @}

/// The shape of a field in D dimensions: one number (scalar), D numbers (vector), a D × D matrix, or the upper triangle
/// of a symmetric D × D matrix; and in two dimensions the vectors and matrices of three (vector_3d, matrix_3d), which a
/// material has in plane strain.
enum class FieldShape : std::uint8_t { scalar, vector, matrix, symmetric_matrix, vector_3d, matrix_3d };

/// The type of a field's numbers. `real` is the particles' floating-point type.
enum class FieldNumber : std::uint8_t { real, uint32, float64 };

/// The role of a field: when it is written, and by what.
enum class FieldRole : std::uint8_t {
    motion,    ///< written in every step
    affine,    ///< written by affine transfers; otherwise it keeps its start value, and saved states may lack it
    stress,    ///< written by G2P for the next P2G; it can be computed from the material's state
    given,     ///< set by the program when it adds the particle; no step changes it
    constant,  ///< keeps its start value unless the program sets it; no step changes it
    state      ///< part of the material's state; written by the material
};

/// Which values of a field are valid in a saved state when a run is continued from this state.
enum class FieldRange : std::uint8_t { finite, not_negative, positive };

/// The description of one field: one entry of a FieldTable.
struct FieldInfo {
    const char* name;  ///< name of the field in saved states and in GPU programs
    const char* unit;  ///< unit of the field, such as "m/s"
    FieldShape shape;  ///< shape of the field
    FieldRole role;    ///< which part of a program writes the field
    /// Start values of the components, as they are stored, which new particles and padding get. The components of a
    /// matrix are listed column by column.
    std::array<double, 9> start{};
    FieldRange range = FieldRange::finite;   ///< which values of the field are valid in a saved state
    FieldNumber number = FieldNumber::real;  ///< type of the field's numbers
    /// True if memory holds the number, or the diagonal of the matrix, less 1, because it is a DeformationGradient or a
    /// VolumeRatio. A saved state has the number itself, and what it cannot hold of the difference in a field of its
    /// own. \see remainder_name
    bool less_one = false;

    /// True if `value` lies in the field's range.
    /// \param value  a finite number
    constexpr bool allows(double value) const {
        return range == FieldRange::positive ? value > 0 : range == FieldRange::finite || value >= 0;
    }
    /// Returns the number of stored components per particle in d dimensions.
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
            case FieldShape::vector_3d:
                return 3;
            case FieldShape::matrix_3d:
                return 9;
        }
        return 0;
    }
    /// Returns the number of components per particle in a saved state, in d dimensions. A saved state contains all d²
    /// elements of a symmetric matrix.
    constexpr int components_in_state(int d) const {
        return shape == FieldShape::symmetric_matrix ? d * d : components(d);
    }
    /// Returns whether the component with index k in a saved state is stored less 1. \param d  dimension of space
    constexpr bool is_less_one(int d, int k) const {
        return less_one && (shape == FieldShape::scalar || k % (side(d) + 1) == 0);
    }
    /// Returns the number of components per particle that are stored less 1, in d dimensions.
    constexpr int components_less_one(int d) const { return !less_one ? 0 : shape == FieldShape::scalar ? 1 : side(d); }
    /// Returns the number of rows of the field's matrices, in d dimensions of space.
    constexpr int side(int d) const { return shape == FieldShape::matrix_3d ? 3 : d; }
    /// Returns the name of the field of a saved state that holds the remainders of the components that are stored less
    /// 1: what each rounded component, less 1, lacks of the stored number.
    std::string remainder_name() const { return std::string(name) + "_remainder"; }
    /// Returns the index, among the field's stored components, of the component that has index k in a saved state. In a
    /// saved state, matrices are stored row by row. \param d  dimension of space
    constexpr int component_of(int d, int k) const {
        switch (shape) {
            case FieldShape::matrix:
            case FieldShape::matrix_3d:
                return k % side(d) * side(d) + k / side(d);
            case FieldShape::symmetric_matrix:
                return symmetric_index(d, k / d, k % d);
            default:
                return k;
        }
    }
};

/// A table of all fields of a particle, with one entry per field.
using FieldTable = std::vector<FieldInfo>;

namespace detail {
/// Returns the index of a field in a table, or the number of its fields if it has none of this name.
inline std::size_t field_index(const FieldTable& table, std::string_view name) {
    std::size_t f = 0;
    while (f < table.size() && table[f].name != name) ++f;
    return f;
}
}  // namespace detail

/// Returns an array for FieldInfo::start in which all start values equal `number`.
constexpr std::array<double, 9> everywhere(double number) {
    std::array<double, 9> all{};
    all.fill(number);
    return all;
}

}  // namespace firn::inline FIRN_BUILD
