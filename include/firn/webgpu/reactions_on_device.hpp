/// \file Reads the sums of impulses of a boundary and of loads that a device has made. \see Reactions
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/data/domain.hpp>
#include <firn/loops/reactions.hpp>
#include <firn/webgpu/from_corner.hpp>
#include <firn/webgpu/host.hpp>
#include <firn/webgpu/set_on_device.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Returns the largest arm of a node or a particle [m].
/// \param about  the point about which angular impulses are taken [m]
template <int D>
double largest_arm(const Vec<double, D>& about, const Domain<D>& domain) {
    constexpr double beyond = 8;  // nodes lie outside of the domain, too [cells]
    double farthest = 0;
    for (int a = 0; a < D; ++a)
        for (const double end : {domain.lower[a], domain.upper[a]})
            farthest = std::max(farthest, std::abs(end - about[a]) + beyond * domain.cell_size);
    return farthest;
}
/// Returns a power of two, at most one half over a number.
inline double half_over(double number) { return std::exp2(std::floor(-std::log2(2 * number))); }
/// Returns the uniform "per_arm" [1/m]: a power of two, at most one half over the largest arm of a node.
/// \param parts  the reactions of all parts of the boundary
template <int D>
double scale_of_arms(const std::vector<Reaction<D>>& parts, const Domain<D>& domain) {
    double farthest = 0;
    for (const Reaction<D>& part : parts) farthest = std::max(farthest, largest_arm(part.about, domain));
    return half_over(farthest);
}

/// Returns the uniform "load_per_arm" [1/cell], as scale_of_arms().
template <int D>
double scale_of_load_arms(const Vec<double, D>& about, const Domain<D>& domain) {
    return half_over(largest_arm(about, domain) / domain.cell_size);
}
/// Sets the uniforms of the reactions of loads, if the program has them.
/// \param reactions  the reactions of the simulation, if they are wanted
template <int D>
void set_load_reactions(wgsl::Inputs& inputs, const wgsl::Program& program, const Domain<D>& domain,
                        const std::optional<Reactions<D>>& reactions) {
    if (!program.has("begin_push")) return;
    const Vec<double, D> about = reactions->about.value_or(Vec<double, D>::zero());
    std::vector<double> cell, rest;
    for (int a = 0; a < D; ++a) {
        const double cells = (about[a] - domain.lower[a]) / domain.cell_size;
        cell.push_back(double(float(std::floor(cells))));
        rest.push_back(cells - cell.back());
    }
    inputs.set("load_about_cell", cell), inputs.set("load_about_rest", rest);
    inputs.set("load_per_arm", {scale_of_load_arms(about, domain)});
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

/// Adds integers of 96 bits to the impulses and the angular impulses of a reaction.
/// \param words  the integers, three words each. \see reaction_kernels.hpp
/// \param scale  of an impulse;  \param per_arm  how much larger that of an angular impulse is
template <int D>
void add_impulses(Reaction<D>& reaction, const std::uint32_t* words, double scale, double per_arm) {
    int k = 0;
    firn::detail::for_impulses(reaction, [&](double& component) {
        const double high = double(std::int32_t(words[2]));
        // In 96 bits, a small negative sum is −2⁶⁴ and what is missing to it: that is exact only as an integer.
        const auto low = std::int64_t(std::uint64_t{words[1]} << 32 | words[0]);
        const double sum = (high + (low < 0 ? 1 : 0)) * 0x1p64 + double(low);
        component += sum / scale / (k++ < D ? 1 : per_arm);
        words += 3;
    });
}

/// Sets the impulses and the angular impulses of reactions to those of the last step of a program.
/// \param per_arm  the uniform of that step
/// \param parts    the reactions of all parts of the boundary, without impulses
template <int D>
void read_impulses(Host& host, double per_arm, std::vector<Reaction<D>>& parts) {
    const std::vector<std::uint32_t> words = host.read_buffer<std::uint32_t>("reactions");
    const double scale = 0x1p13 * double(std::bit_cast<float>(words.at(0))) * double(host.status().mass_scale);
    for (std::size_t k = 0; k < parts.size(); ++k)
        add_impulses(parts[k], &words.at(1 + k * 3 * std::size_t(wgsl::detail::impulses_of_part(D))), scale, per_arm);
}

/// Returns what the loads of a set exerted on its particles in the last step.
/// \param k      number of the set
/// \param about  the point about which angular impulses are taken [m]
template <class Set, int D>
void read_loads(const Set& set, std::uint32_t k, const SetOnDevice<D>& there, const Domain<D>& domain,
                const Vec<double, D>& about, std::vector<LoadReaction<D>>& loads) {
    if (!there.program.has("begin_push")) return;
    const std::size_t count = list_of_loads(set.loads).size(), first = loads.size();
    for (std::size_t l = 0; l < count; ++l)
        loads.push_back({{k, firn::detail::loads_of(set.loads)->number(l)}, {about, {}, {}}});
    const double per_arm = scale_of_load_arms(about, domain) / domain.cell_size;
    for (const Chunk& chunk : there.chunks) {
        const std::vector<std::uint32_t> words = chunk.host->template read_buffer<std::uint32_t>("load_reactions");
        for (std::size_t l = 0; l < count; ++l)
            add_impulses(loads[first + l].reaction,
                         &words.at(count + l * 3 * std::size_t(wgsl::detail::impulses_of_part(D))),
                         0x1p44 * double(std::bit_cast<float>(words.at(l))), per_arm);
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
        if (next.parts.empty()) return;
        set_points(grid, next.parts, corner_of<Boundary>(domain));
        per_arm = scale_of_arms(next.parts, domain);
        grid.set("per_arm", {per_arm});
    }
    /// Reads the reactions of the step.
    /// \param sets   the sets of particles of the simulation;  \param there  those on the device
    void read(const SetList<float, D>& sets, const std::vector<SetOnDevice<D>>& there, const Domain<D>& domain,
              Reactions<D>& reactions) const {
        reactions.parts = next.parts;
        if (!reactions.parts.empty()) read_impulses(*there[0].chunks[0].host, per_arm, reactions.parts);
        reactions.loads.clear();
        const Vec<double, D> about = reactions.about.value_or(Vec<double, D>::zero());
        for (std::size_t k = 0; k < there.size(); ++k)
            read_loads(sets[k], std::uint32_t(k), there[k], domain, about, reactions.loads);
    }
};

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
