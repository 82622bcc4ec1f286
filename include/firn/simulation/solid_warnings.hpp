/// \file Warnings about solids: those that are too thin for their cells, and those whose distances are capped.
#pragma once

#include <firn/boundary/collider.hpp>
#include <firn/boundary/concept.hpp>
#include <firn/boundary/distance_grid.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/core/error.hpp>
#include <firn/data/domain.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace firn::inline FIRN_BUILD::detail {

template <class B>
inline constexpr bool is_collider = false;
template <class Shape>
inline constexpr bool is_collider<Collider<Shape>> = true;
template <class Shape>
inline constexpr bool is_sphere = false;
template <class S, int D>
inline constexpr bool is_sphere<Sphere<S, D>> = true;

/// Calls see(collider, by_gap) for every collider of a boundary. \see for_single_parts
template <class Boundary, class See>
void for_colliders(const Boundary& boundary, const See& see) {
    for_single_parts(boundary, [&]<class Part>(const Part& part, bool by_gap) {
        if constexpr (is_collider<Part>) see(part, by_gap);
    });
}

/// Calls see(x) for points of a lattice around a solid, in the coordinates of its shape [m]. If the shape does not tell
/// its extent, they fill the domain.
template <class Solid, int D, class See>
void for_points_around(const Solid& solid, const Domain<D>& domain, const See& see) {
    constexpr int along = 7;
    for (int i = 0; i < int(std::pow(along, D) + 0.5); ++i) {
        Vec<double, D> part{};  // of the lattice, −1 to 1
        for (int a = 0, rest = i; a < D; ++a, rest /= along) part[a] = 2.0 * (rest % along) / (along - 1) - 1;
        if constexpr (requires { solid.shape.extent(); }) {
            see(part * (solid.shape.extent() + domain.cell_size));
        } else {
            Vec<double, D> x{};
            for (int a = 0; a < D; ++a)
                x[a] = 0.5 * (domain.lower[a] + domain.upper[a] + part[a] * (domain.upper[a] - domain.lower[a]));
            see(transpose(matrix_of(solid.rotation)) * (x - solid.position));
        }
    }
}

/// Returns how thick a shape is where it is thickest [m], as far as seen from a point; or `most` if it is as thick.
///
/// From the surface, the depth grows along the inward normal up to the middle between two faces. It is looked for in
/// short steps first, so that a face behind the next gap is not taken.
/// \param shape  in double
template <class Shape, int D>
double thickness_from(const Shape& shape, Vec<double, D> x, double most) {
    double distance = shape.signed_distance(x);
    for (int i = 0; i < 64 && distance > 1e-3 * most; ++i) {
        x -= normal_of(shape, x) * distance;
        distance = shape.signed_distance(x);
    }
    const Vec<double, D> inwards = -normal_of(shape, x);
    const auto depth = [&](double way) { return -shape.signed_distance(x + inwards * way); };
    const double step = most / 64;
    double low = 0;
    while (low < most && depth(low + step) > depth(low)) low += step;
    double high = low + step;
    low = std::max(low - step, 0.0);
    for (int i = 0; i < 50; ++i) {
        const double a = low + (high - low) / 3, b = high - (high - low) / 3;
        (depth(a) < depth(b) ? low : high) = depth(a) < depth(b) ? a : b;
    }
    double thickness = std::max(2 * depth(low), 0.0);
    if constexpr (requires { shape.uncertainty(); }) {
        // Interpolation rounds off the middle. If the ray leaves the shape soon, its way tells more.
        double inside = low, outside = thickness + shape.uncertainty();
        if (depth(outside) < 0 && depth(inside) > 0) {
            for (int i = 0; i < 50; ++i) {
                const double between = 0.5 * (inside + outside);
                (depth(between) > 0 ? inside : outside) = between;
            }
            thickness = std::max(thickness, inside);
        }
    }
    return std::min(thickness, most);
}

/// Returns a sentence if a solid of the boundary is so thin that matter at one of its faces shares nodes with the other
/// face; otherwise an empty string.
///
/// Measured with two fingers that press a block and open again, with quadratic splines and up to 4 particles along an
/// axis of a cell. Colliders that do not act by the gap: of 1.6 cells, turned by 20°, they pull with 18 % of the force
/// that they pressed with, of 2.4 cells with 4 %, of 3 cells with 1 %. Spheres of any size: 0.2 %. By the gap: less
/// than 1 % from 0.4 cells on. A block behind a plate that another block in front of it moves away from takes 100, 27,
/// 1 and 0 % of the plate's speed for 1.6, 2, 2.4 and 2.8 cells; in a contact group of its own, by the gap, 0 %.
/// \param has_groups  whether matter may be in contact groups
template <class Boundary, int D>
[[gnu::cold]] std::string thin_solids(const Boundary& boundary, const Domain<D>& domain, bool has_groups) {
    std::string text;
    for_colliders(boundary, [&]<class Shape>(const Collider<Shape>& solid, bool by_gap) {
        if constexpr (!is_flat<Shape> && !is_sphere<Shape>) {
            if (!text.empty() || (solid.contact != Contact::separate && solid.contact != Contact::slip)) return;
            if (by_gap && has_groups) return;
            const double h = domain.cell_size, needed = by_gap ? 2.5 * h : 3 * h;
            const auto shape = lift<double>(solid.shape);
            double thickness = 0;
            for_points_around(solid, domain, [&](const Vec<double, D>& x) {
                if (thickness < needed) thickness = std::max(thickness, thickness_from(shape, x, needed));
            });
            if (!(thickness < 0.999 * needed)) return;
            text = sentence("a ", solid.name, " at ", point_text(solid.position.v, D), " m is about ", thickness,
                            " m thick, ", thickness / h, " cells: ");
            text += by_gap
                        ? "matter on both of its sides shares nodes, and moves as one there. Make it 2.5 cells thick, "
                          "or give the matter on each side a contact group; matter on one side alone is right."
                        : "nodes near one of its faces pull at matter that leaves the other, and matter on both of "
                          "its sides moves as one. Make it 3 cells thick, or let the boundary act by the gap: "
                          "firn::GapContact.";
        }
    });
    return text;
}

/// Returns the size [m] from which on stored distances are the same, if they seem to be capped; else infinity. The
/// distance d of a point cannot be the same at its neighbours along all axes, unless these are more than 2 d/√D away.
template <class Number, int D>
[[gnu::cold]] double cap_of(const DistanceNumbers<Number, D>& numbers) {
    const double none = std::numeric_limits<double>::infinity();
    if (numbers.values.empty()) return none;
    const Number most = *std::max_element(numbers.values.begin(), numbers.values.end());
    if (!(double(most) > 0.5 * std::sqrt(double(D)) * numbers.spacing)) return none;
    for (std::size_t i = 0; i < numbers.values.size(); ++i) {
        bool is_capped = numbers.values[i] == most;
        for (std::size_t a = D, rest = i, stride = 1; a-- > 0 && is_capped;) {
            const std::size_t count = std::size_t(numbers.nodes[a]), along = rest % count;
            is_capped = along > 0 && along + 1 < count && numbers.values[i - stride] == most &&
                        numbers.values[i + stride] == most;
            rest /= count;
            stride *= count;
        }
        if (is_capped) return double(most);
    }
    return none;
}
/// Returns the same for a shape, as far as seen from points around the solid; infinity if the cap is above `needed`
/// [m].
template <class Solid, int D>
[[gnu::cold]] double cap_of(const Solid& solid, const Domain<D>& domain, double needed) {
    double cap = std::numeric_limits<double>::infinity();
    const auto shape = lift<double>(solid.shape);
    for_points_around(solid, domain, [&](const Vec<double, D>& x) {
        const double distance = shape.signed_distance(x), away = std::min(distance, domain.cell_size);
        bool is_same = distance > 1e-3 * domain.cell_size && distance < std::min(cap, needed);
        for (int a = 0; a < D; ++a)
            for (const double side : {-away, away}) {
                if (!is_same) return;
                Vec<double, D> beside = x;
                beside[a] += side;
                is_same = shape.signed_distance(beside) == distance;
            }
        if (is_same) cap = distance;
    });
    return cap;
}

/// Returns a sentence if the distances of a solid of the boundary seem to be capped below what its contact compares
/// them with, and its shape does not say so; otherwise an empty string.
template <class Boundary, int D>
[[gnu::cold]] std::string capped_distances(const Boundary& boundary, const Domain<D>& domain) {
    std::string text;
    for_colliders(boundary, [&]<class Shape>(const Collider<Shape>& solid, bool) {
        if constexpr (!is_flat<Shape>) {
            if (!text.empty() || solid.contact == Contact::none) return;
            const double h = domain.cell_size, needed = double(solid.on_grid(h).layer()) + 2 * h;
            double cap;
            if constexpr (requires { cap_of(*solid.shape.numbers); })
                cap = cap_of(*solid.shape.numbers);
            else
                cap = cap_of(solid, domain, needed);
            if (cap < needed)
                text =
                    sentence("a ", solid.name, " at ", point_text(solid.position.v, D), " m caps its distances at ",
                             cap, " m, and its contact compares them up to ", needed,
                             " m, its layer and two cells: it acts on nodes that are far away. Store distances up to ",
                             needed, " m; let the shape say what it knows by exact_up_to().");
        }
    });
    return text;
}

}  // namespace firn::inline FIRN_BUILD::detail
