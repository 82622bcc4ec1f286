/// \file Where the CPU measures positions from the domain's lower corner, a GPU does so, too.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/boundary/measured_from.hpp>
#include <firn/data/domain.hpp>
#include <firn/field/gravity.hpp>
#include <firn/loops/grid_update.hpp>
#include <firn/wgsl/inputs.hpp>

#include <concepts>
#include <utility>
#include <vector>

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

/// Returns an acceleration as a program with such a boundary has it.
/// \param acceleration  a vector [m/s²] or a field. \see lifted_acceleration
template <class Boundary, int D, class Acceleration>
auto field_from_corner(const Acceleration& acceleration, const Domain<D>& domain) {
    const Vec<double, D> corner = corner_of<Boundary>(domain);
    if constexpr (firn::detail::is_uniform<Acceleration>)
        return Gravity<float, D>{cast<float>(acceleration)};
    else if constexpr (requires { acceleration.measured_from(corner), Acceleration::name; })
        return acceleration.measured_from(corner);
    else if constexpr (requires { acceleration.measured_from(corner); })
        return FieldInMetres<Acceleration, D>{acceleration.measured_from(corner), Vec<double, D>::zero()};
    else
        return FieldInMetres<Acceleration, D>{acceleration, corner};
}
/// Returns the numbers of an acceleration or a boundary: the components of a vector, or the parameters.
template <class Policy>
std::vector<double> numbers_of(const Policy& policy) {
    std::vector<double> all;
    const auto add = [&](const auto&, const std::vector<double>& some) {
        all.insert(all.end(), some.begin(), some.end());
    };
    if constexpr (firn::detail::is_uniform<Policy>)
        add("", firn::detail::as_doubles(policy));
    else
        wgsl::for_numbers_of(policy, "policy", add);
    return all;
}

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
