/// \file Reads the sums of a boundary's impulses that a device has made. \see Reactions
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/data/domain.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/webgpu/from_corner.hpp>
#include <firn/webgpu/host.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Returns the uniform "per_arm" [1/m]: a power of two, at most one half over the largest arm of a node.
/// \param parts  the reactions of all parts of the boundary
template <int D>
double scale_of_arms(const std::vector<Reaction<D>>& parts, const Domain<D>& domain) {
    constexpr double beyond = 8;  // nodes lie outside of the domain, too [cells]
    double farthest = 0;
    for (const Reaction<D>& part : parts)
        for (int a = 0; a < D; ++a)
            for (const double end : {domain.lower[a], domain.upper[a]})
                farthest = std::max(farthest, std::abs(end - part.about[a]) + beyond * domain.cell_size);
    return std::exp2(std::floor(-std::log2(2 * farthest)));
}

/// Gives a program the points about which angular impulses are taken.
/// \param corner  the point from which the program measures positions [m]
template <int D>
void set_points(Host& host, const std::vector<Reaction<D>>& parts, const Vec<double, D>& corner) {
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const Vec<double, D> about = parts[k].about - corner;
        host.set(sentence("about_", k), {about.v, about.v + D});
    }
}

/// Sets the impulses and the angular impulses of reactions to those of the last step of a program.
/// \param per_arm  the uniform of that step
/// \param parts    the reactions of all parts of the boundary
template <int D>
void read_impulses(Host& host, double per_arm, std::vector<Reaction<D>>& parts) {
    const std::vector<std::uint32_t> words = host.read_buffer<std::uint32_t>("reactions");
    const double scale = 0x1p13 * double(std::bit_cast<float>(words.at(0))) * double(host.status().mass_scale);
    std::size_t at = 1;
    for (Reaction<D>& part : parts) {
        int k = 0;
        firn::detail::for_impulses(part, [&](double& component) {
            const double high = double(std::int32_t(words.at(at + 2)));
            // In 96 bits, a small negative sum is −2⁶⁴ and what is missing to it: that is exact only as an integer.
            const auto low = std::int64_t(std::uint64_t{words.at(at + 1)} << 32 | words.at(at));
            const double sum = (high + (low < 0 ? 1 : 0)) * 0x1p64 + double(low);
            component = sum / scale / (k++ < D ? 1 : per_arm);
            at += 3;
        });
    }
}

/// The reactions of the step that a device is given next, or was given last.
template <int D>
struct ReactionsOnDevice {
    Reactions<D> next{};  ///< the points about which angular impulses are taken
    double per_arm = 1;   ///< \see scale_of_arms

    /// Gives the points to the device.
    /// \param wanted  the reactions of the simulation
    template <class Boundary>
    void begin(Host& grid, const Reactions<D>& wanted, const Boundary& boundary, const Domain<D>& domain) {
        next.about = wanted.about;
        firn::detail::begin_reactions(next, boundary);
        set_points(grid, next.parts, corner_of<Boundary>(domain));
        per_arm = scale_of_arms(next.parts, domain);
        grid.set("per_arm", {per_arm});
    }
    /// Reads the reactions of the step.
    void read(Host& grid, Reactions<D>& reactions) const {
        reactions.parts = next.parts;
        reactions.loads.clear();
        read_impulses(grid, per_arm, reactions.parts);
    }
};

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
