/// \file Bodies of warnings.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/data/samples.hpp>
#include <firn/simulation/fracture.hpp>
#include <firn/simulation/warnings.hpp>
#include <firn/sort/radix_sort.hpp>

namespace firn::inline FIRN_BUILD::detail {

/// Returns a sentence if samples are further apart than the cell size; otherwise an empty string.
template <int D>
[[gnu::cold]] std::string wide_spacing(const Samples<D>& samples, double cell_size) {
    const double spacing = std::pow(samples.volume, 1.0 / D);
    if (!(spacing > cell_size * (1 + 1e-9)) || samples.positions.size() < 2) return {};
    return sentence("the particles of a body lie ", spacing, " m apart, further than a cell of ", cell_size,
                    " m: empty cells divide it, and it falls to pieces. Sample it with the spacing "
                    "particle_spacing<",
                    D, ">(cell_size, ", 1 << D, ") = ", particle_spacing<D>(cell_size, 1 << D), " m.");
}

template <std::floating_point S, int D>
[[gnu::cold]] void for_particles(const SetList<S, D>& sets,
                                 const std::type_identity_t<std::function<void(const ParticleOfBody<D>&)>>& see) {
    std::size_t first = 0;
    for (const SetOf<S, D>& set : sets) {
        const ParticleStore<S, D>& particles = set.store();
        for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
            if (!particles.is_particle(slot)) continue;
            const std::uint32_t id = particles.id(slot);
            const std::size_t b = set.body_of(id);
            if (b < set.bodies.size())
                see({first + b, id, double(particles.volume(slot)), particles.exact_position(slot)});
        }
        first += set.bodies.size();
    }
}

/// A body with its bounding box and the positions of its particles, to find out whether it overlaps other bodies.
template <int D>
struct BodyPoints {
    std::size_t material;
    Body body;
    double spacing = 0;  ///< distance between the body's particles [m]
    Vec<double, D> lower = Vec<double, D>::filled(std::numeric_limits<double>::infinity());
    Vec<double, D> upper = Vec<double, D>::filled(-std::numeric_limits<double>::infinity());
    bool has_neighbours = false;
    std::vector<Vec<double, D>> points{};  ///< positions of the body's particles [m]; empty if !has_neighbours

    bool meets(const BodyPoints& other) const;
    double edge() const { return 4 * spacing; }  ///< edge length of the cubes of cubes_filled_by() [m]

    /// Divides this body's bounding box into cubes of edge length edge(). Returns the keys (block_key) of those cubes
    /// that the points of the other body (`of`) fill to at least 60 %, in ascending order.
    [[gnu::cold]] std::vector<std::uint64_t> cubes_filled_by(const BodyPoints& of) const;
    /// Returns whether there is a cube in this body's bounding box that both bodies fill. Bodies that only touch do not
    /// fill a common cube. \see cubes_filled_by
    /// \param where  receives a position in the first such cube [m]; unchanged if there is no such cube
    bool overlaps(const BodyPoints& other, Vec<double, D>& where) const;
    std::string name() const;
};

template <int D>
[[gnu::cold]] bool BodyPoints<D>::meets(const BodyPoints& other) const {
    bool meets = spacing > 0 && other.spacing > 0;
    for (int a = 0; a < D; ++a) meets = meets && lower[a] < other.upper[a] && other.lower[a] < upper[a];
    return meets;
}

template <int D>
[[gnu::cold]] std::vector<std::uint64_t> BodyPoints<D>::cubes_filled_by(const BodyPoints& of) const {
    RadixSort<std::uint64_t> cubes;
    for (const Vec<double, D>& x : of.points) {
        BlockCoordinate<D> cube{};
        bool within = true;
        for (int a = 0; a < D; ++a) {
            within = within && x[a] >= lower[a] - spacing / 2 && x[a] <= upper[a] + spacing / 2;
            if (within) cube[std::size_t(a)] = int((x[a] - lower[a]) / edge() + 0.125);
        }
        if (within) cubes.items.push_back({block_key<D>(cube), 0});
    }
    cubes.sort();
    const double needed = 0.6 * std::pow(edge() / of.spacing, D);
    std::vector<std::uint64_t> filled;
    for (std::size_t i = 0, next = 0; i < cubes.items.size(); i = next) {
        while (next < cubes.items.size() && cubes.items[next].key == cubes.items[i].key) ++next;
        if (double(next - i) >= needed) filled.push_back(cubes.items[i].key);
    }
    return filled;
}

template <int D>
[[gnu::cold]] bool BodyPoints<D>::overlaps(const BodyPoints& other, Vec<double, D>& where) const {
    const std::vector<std::uint64_t> mine = cubes_filled_by(*this), its = cubes_filled_by(other);
    for (std::size_t i = 0, j = 0; i < mine.size() && j < its.size(); (mine[i] < its[j] ? i : j) += 1)
        if (mine[i] == its[j]) {
            const BlockCoordinate<D> cube = block_of_key<D>(mine[i]);
            for (int a = 0; a < D; ++a) where[a] = lower[a] + (double(cube[std::size_t(a)]) + 0.375) * edge();
            return true;
        }
    return false;
}

template <int D>
[[gnu::cold]] std::string BodyPoints<D>::name() const {
    return sentence("that of the particles ", body.first, " to ", body.first + (body.count - 1), " of material ",
                    material);
}

template <std::floating_point S, int D>
[[gnu::cold]] std::string overlapping_bodies(const SetList<S, D>& sets) {
    std::vector<BodyPoints<D>> all;
    for (std::size_t material = 0; material < sets.size(); ++material)
        for (const Body& body : sets[material].bodies) all.push_back({material, body});
    for_particles(sets, [&](const ParticleOfBody<D>& one) {
        BodyPoints<D>& body = all[one.body];
        body.spacing = std::pow(one.volume, 1.0 / D);
        for (int a = 0; a < D; ++a) {
            body.lower[a] = std::min(body.lower[a], one.x[a]);
            body.upper[a] = std::max(body.upper[a], one.x[a]);
        }
    });
    bool meet = false;
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (all[i].meets(all[j])) meet = all[i].has_neighbours = all[j].has_neighbours = true;
    if (!meet) return {};
    for_particles(sets, [&](const ParticleOfBody<D>& one) {
        if (all[one.body].has_neighbours) all[one.body].points.push_back(one.x);
    });
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (Vec<double, D> where{}; all[i].meets(all[j]) && all[i].overlaps(all[j], where))
                return sentence("two bodies overlap around ", text_of(where), " m, ", all[j].name(), " and ",
                                all[i].name(),
                                ": the place holds matter twice, which will burst apart. Move one of them, or leave "
                                "out the positions that lie in both.");
    return {};
}

/// Returns a sentence about the first particle that has reached a face of the domain; an empty string if there is no
/// such particle. Faces of periodic axes do not count.
template <std::floating_point S, int D>
[[gnu::cold]] std::string matter_at_the_end(const SetList<S, D>& sets, const Domain<D>& domain) {
    std::string text;
    const double near = 1e-3 * domain.cell_size;
    for_particles(sets, [&](const ParticleOfBody<D>& one) {
        bool outside = false;
        for (int a = 0; a < D; ++a)
            outside = outside || (!domain.periodic[std::size_t(a)] &&
                                  !(one.x[a] > domain.lower[a] + near && one.x[a] < domain.upper[a] - near));
        if (outside && text.empty())
            text = sentence("particle ", one.id, " has come to the end of the domain, at ", text_of(one.x),
                            " m, where the boundary holds nothing: it stays there and gathers momentum. A boundary "
                            "that you give replaces the default walls; to have both, give "
                            "firn::Together(firn::Walls<…>::all(…), …). To let matter leave, add a sink.");
    });
    return text;
}

FIRN_BODY std::string Warnings::of_bound(double bound, std::uint64_t step, double time,
                                         const std::function<std::string()>& reason) {
    largest_ = std::max(largest_, bound);
    if (bound >= 1e-6 && bound >= 1e-3 * largest_) return {};
    return of_small_bound(bound, step, time, reason);
}

FIRN_BODY std::string Warnings::of_step(double fixed, double bound, bool by_acceleration, std::uint64_t step,
                                        bool warns) {
    const double ratio = fixed / bound;
    if (ratio < 1.2 * said_ratio_ || std::isinf(said_ratio_)) return {};
    said_ratio_ = ratio;
    if (!warns) return {};
    const char* const outcome =
        by_acceleration ? ", which is set by gravity or another acceleration; matter falls too far in a step, and "
                          "may pass what it should meet."
                        : "; the simulation may become unstable.";
    return sentence("the fixed time step of ", fixed, " s is ", ratio, " times the bound of ", bound, " s at step ",
                    step, outcome);
}

template <std::floating_point S, int D>
std::string Warnings::of_matter(SetList<S, D>& sets, const Domain<D>& domain, const KernelFacts& kernel,
                                bool has_all_walls, bool tells_strain, const Moment& now, int threads,
                                const RanksOf<S, D>& ranks) {
    std::string text;
    if (now.steps % 32 == 0 && !end_said_ && !has_all_walls) {
        text = ranks.text_of_first(matter_at_the_end(sets, domain));
        end_said_ = !text.empty();
    }
    if (now.steps % 32 == 0 && text.empty() && !stretch_said_) {
        text = ranks.text_of_first(too_far_stretched(sets, kernel, threads));
        stretch_said_ = !text.empty();
    }
    return text.empty() ? slow_strain_.look(sets, now, tells_strain, ranks) : text;
}

template <int D>
[[gnu::cold]] void Warnings::of_spacing(const Samples<D>& samples, const Domain<D>& domain, const Warn& warn,
                                        bool speaks) {
    if (!warn || spacing_said_) return;
    const std::string text = wide_spacing(samples, domain.cell_size);
    spacing_said_ = !text.empty();
    if (!text.empty() && speaks) warn(text);
}

[[gnu::cold]] FIRN_BODY std::string Warnings::of_small_bound(double bound, std::uint64_t step, double time,
                                                             const std::function<std::string()>& reason) {
    const bool fallen = bound < 1e-3 * largest_, small = bound < 1e-6;
    if ((!fallen || fallen_said_) && (!small || small_said_)) return {};
    std::string text = sentence("at step ", step, ", at ", time, " s, the bound of the time step ");
    if (fallen && !fallen_said_)
        text += sentence("has fallen to ", bound, " s, from ", largest_, " s: the run may be blowing up. ");
    else
        text += sentence("is ", bound, " s: a second takes ", 1 / bound,
                         " steps of that size. A softer material or larger cells allow larger ones. ");
    fallen_said_ = fallen_said_ || fallen;
    small_said_ = true;
    return text + reason();
}

}  // namespace firn::inline FIRN_BUILD::detail
