/// \file What is said of a particle that has failed in a step on a device.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/data/domain.hpp>
#include <firn/loops/wrong_particles.hpp>
#include <firn/webgpu/set_on_device.hpp>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Returns a sentence with the id, the position and the velocity of particle i of a set, as the device has them.
/// \param material  name of the set's material; empty if there is no other
template <int D>
[[gnu::cold]] std::string text_of_particle(const SetOnDevice<D>& set, std::size_t i, const Domain<D>& domain,
                                           std::string_view material) {
    const Chunk& chunk = set.chunk_of(i);
    const auto of_particle = [&](const char* component) {
        const std::vector<float> all = chunk.host->template read<float>(component);
        Vec<double, D> value{};
        for (std::size_t a = 0; a < std::size_t(D); ++a) value[int(a)] = double(all[i * std::size_t(D) + a]);
        return value;
    };
    Vec<double, D> x = domain.lower + (of_particle("corner") + of_particle("place")) * domain.cell_size;
    for (int a = 0; a < D; ++a) x[a] = into_domain(domain, a, x[a]);
    const Vec<double, D> v = of_particle("velocity");
    firn::detail::ParticleFacts facts{.id = chunk.ids[i], .dimension = D, .has_position = true};
    std::copy_n(x.v, D, facts.position);
    std::copy_n(v.v, D, facts.velocity);
    return sentence("It is ", facts.text(), material.empty() ? "" : ", of the material ", material, ".");
}

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
