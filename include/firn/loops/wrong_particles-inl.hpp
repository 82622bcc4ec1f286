/// \file Bodies of wrong_particles.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/loops/wrong_particles.hpp>

namespace firn::inline FIRN_BUILD::detail {

[[gnu::cold]] FIRN_BODY double ParticleFacts::speed() const {  ///< Returns |v| [m/s].
    double square = 0;
    for (int a = 0; a < dimension; ++a) square += velocity[a] * velocity[a];
    return std::sqrt(square);
}

[[gnu::cold]] FIRN_BODY std::string ParticleFacts::text() const {
    return sentence("particle ", id, has_position ? " at " + point_text(position, dimension) + " m" : "",
                    " with velocity ", point_text(velocity, dimension), " m/s",
                    has_volume_ratio ? sentence(", J = ", volume_ratio) : "");
}

[[gnu::cold]] FIRN_BODY void ParticleFacts::look_at(const char* name, const double* numbers, int components) {
    bool finite = true;
    for (int k = 0; k < components; ++k) finite = finite && std::isfinite(numbers[k]);
    if (finite) return;
    not_finite += not_finite.empty() ? "not finite: its " : ", its ";
    for (; *name; ++name) not_finite += *name == '_' ? ' ' : *name;
}

[[gnu::cold]] FIRN_BODY void WrongParticles::see(ParticleFacts& one) {
    if (by_velocity ? one.not_finite.empty() && !one.has_passed : !one.at_face) return;
    ++count;
    std::size_t place = std::min(count, lowest_.size()) - 1;
    if (count > lowest_.size() && lowest_[place] < one.id) return;
    for (; place > 0 && lowest_[place - 1] > one.id; --place) lowest_[place] = lowest_[place - 1];
    lowest_[place] = one.id;
    if (place == 0) first_ = std::move(one);
}

[[gnu::cold]] FIRN_BODY std::string WrongParticles::text() const {
    const std::string total = sentence(of, of == 1 ? " particle" : " particles");
    if (count == 0) return sentence("One of ", total, " is not finite, or has left the domain.");
    std::string further;
    for (std::size_t k = 1; k < std::min(count, lowest_.size()); ++k)
        further += sentence(k == 1 ? "; further ids: " : ", ", lowest_[k]);
    if (count > lowest_.size()) further += ", …";
    return sentence(count, " of ", total, count == 1 ? " is" : " are", " not finite, or left the domain. The first is ",
                    first_.text(), ": ", first_.not_finite.empty() ? "it has left the domain" : first_.not_finite,
                    further, ".");
}

}  // namespace firn::inline FIRN_BUILD::detail
