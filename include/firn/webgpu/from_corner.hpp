/// \file Where the CPU measures positions from the domain's lower corner, a GPU does so, too.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/measured_from.hpp>
#include <firn/data/domain.hpp>

#include <concepts>
#include <utility>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Whether a boundary can be moved, so that its positions are measured from the domain's lower corner. Any other gets
/// positions in metres.
template <class Boundary, int D>
inline constexpr bool can_be_moved =
    std::same_as<decltype(measured_from(std::declval<const Boundary&>(), Vec<double, D>{})), Boundary>;

/// Returns a boundary as a program has it. \see measured_from
template <int D, class Boundary>
Boundary boundary_from_corner(const Boundary& boundary, const Domain<D>& domain) {
    if constexpr (can_be_moved<Boundary, D>)
        return measured_from(boundary, domain.lower);
    else
        return boundary;
}
/// Returns the point from which a program with such a boundary measures positions [m].
template <class Boundary, int D>
Vec<double, D> corner_of(const Domain<D>& domain) {
    return can_be_moved<Boundary, D> ? domain.lower : Vec<double, D>::zero();
}
/// Returns a domain as a program with such a boundary has it.
template <class Boundary, int D>
Domain<D> domain_from_corner(Domain<D> domain) {
    const Vec<double, D> corner = corner_of<Boundary>(domain);
    domain.upper = domain.upper - corner;
    domain.lower = domain.lower - corner;
    return domain;
}

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
