/// \file How far the distance constraints of a step are from their solution.
#pragma once

#include <firn/core/requirements.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace firn::inline FIRN_BUILD {

/// What the iterations of a step have left of the errors of distance constraints. Constraints between two pinned points
/// do not count.
///
/// Let C = l − l₀ be the difference of a link's length to its length at rest. The solution of a constraint with the
/// compliance α has C + α̃ λ = 0, where −α̃ λ is its stretch under the impulse λ, see link_solver.hpp; that of a rigid
/// one has C = 0.
struct ConstraintErrors {
    std::uint64_t rigid_count = 0;        ///< Number of constraints without compliance.
    std::uint64_t compliant_count = 0;    ///< Number of constraints with compliance.
    double rigid_squares = 0;             ///< Sum of (C/l₀)² of rigid constraints [1].
    double compliant_squares = 0;         ///< Sum of (C + α̃ λ)² of compliant constraints [m²].
    double stretch_squares = 0;           ///< Sum of (α̃ λ)² of compliant constraints [m²].
    double length_squares = 0;            ///< Sum of l₀² of compliant constraints [m²].
    double worst = 0;                     ///< The largest |C + α̃ λ|/l₀, with λ = 0 if the constraint is rigid [1].
    std::array<std::uint32_t, 2> ends{};  ///< The points, by index, of the constraint with this error.

    /// Returns the root mean square of C/l₀ of rigid constraints [1].
    double rigid() const { return rigid_count > 0 ? std::sqrt(rigid_squares / double(rigid_count)) : 0; }
    /// Returns the root mean square of C + α̃ λ of compliant constraints, divided by that of α̃ λ or by 5e-4 of the
    /// length at rest, whichever is larger [1]. So rounding does not count where links are hardly stretched.
    double compliant() const {
        const double scale = std::max(stretch_squares, 25e-8 * length_squares);
        return compliant_count > 0 ? std::sqrt(compliant_squares / scale) : 0;
    }

    /// Adds the errors of other constraints.
    void add(const ConstraintErrors& other) {
        rigid_count += other.rigid_count;
        compliant_count += other.compliant_count;
        rigid_squares += other.rigid_squares;
        compliant_squares += other.compliant_squares;
        stretch_squares += other.stretch_squares;
        length_squares += other.length_squares;
        if (!(other.worst > worst)) return;
        worst = other.worst;
        ends = other.ends;
    }
};

}  // namespace firn::inline FIRN_BUILD
