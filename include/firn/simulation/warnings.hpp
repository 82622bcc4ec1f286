/// \file What a run is warned of, each once: what can hardly be meant, but is no error.
#pragma once

#include <firn/boundary/concept.hpp>
#include <firn/boundary/contact.hpp>
#include <firn/boundary/walls.hpp>
#include <firn/core/error.hpp>
#include <firn/core/names.hpp>
#include <firn/data/check_particles.hpp>
#include <firn/data/domain.hpp>
#include <firn/data/samples.hpp>
#include <firn/simulation/body.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

namespace firn::detail {

template <int D>
std::string text_of(const Vec<double, D>& x) {
    return point_text(0, D, [&](std::size_t, int a) { return x[a]; });
}

/// A sentence about samples that lie further apart than a cell; or nothing.
template <int D>
std::string wide_spacing(const Samples<D>& samples, double cell_size) {
    const double spacing = std::pow(samples.volume, 1.0 / D);
    if (!(spacing > cell_size * (1 + 1e-9)) || samples.positions.size() < 2) return {};
    return sentence("the particles of a body lie ", spacing, " m apart, further than a cell of ", cell_size,
                    " m: cells without particles part it, and it falls to pieces. Sample it with the spacing "
                    "particle_spacing<",
                    D, ">(cell_size, ", 1 << D, ") = ", particle_spacing<D>(cell_size, 1 << D), " m.");
}

/// A sentence about walls that are not the faces of the domain; or nothing.
template <class Boundary, int D>
std::string other_walls(const Boundary& boundary, const Domain<D>& domain) {
    if constexpr (requires { boundary.at_lower[D - 1], Vec<double, D>(cast<double>(boundary.lower)); }) {
        const Vec<double, D> lower = cast<double>(boundary.lower), upper = cast<double>(boundary.upper);
        bool same = true;
        for (int a = 0; a < D; ++a) {
            const double near = 1e-6 * (std::abs(lower[a]) + std::abs(upper[a])) + 1e-3 * domain.cell_size;
            same = same && std::abs(lower[a] - domain.lower[a]) <= near && std::abs(upper[a] - domain.upper[a]) <= near;
        }
        if (same) return {};
        return sentence("the walls reach from ", text_of(lower), " m to ", text_of(upper), " m, the domain from ",
                        text_of(domain.lower), " m to ", text_of(domain.upper),
                        " m: nothing holds matter outside the walls, and what reaches the end of the domain first "
                        "stops the run. Give both the same corners.");
    } else if constexpr (requires { boundary.parts; }) {
        std::string text;
        std::apply(
            [&](const auto&... part) { ((text.empty() ? void(text = other_walls(part, domain)) : void()), ...); },
            boundary.parts);
        return text;
    } else {
        return {};
    }
}

/// What a body is compared by.
template <int D>
struct BodyPoints {
    std::size_t material;
    Body body;
    double spacing = 0;  ///< of its particles [m]
    Vec<double, D> lower = Vec<double, D>::filled(std::numeric_limits<double>::infinity());
    Vec<double, D> upper = Vec<double, D>::filled(-std::numeric_limits<double>::infinity());
    bool has_neighbours = false;
    std::vector<Vec<double, D>> points{};  ///< of those that have neighbours [m]

    bool meets(const BodyPoints& other) const {
        bool meets = true;
        for (int a = 0; a < D; ++a) meets = meets && lower[a] < other.upper[a] && other.lower[a] < upper[a];
        return meets;
    }
    /// Cubes with an edge of four spacings, those that both fill by six tenths at least, as lattices that lie against
    /// each other do not: where the first such is. \return false: there is none
    bool overlaps(const BodyPoints& other, Vec<double, D>& where) const {
        const double edge = 4 * spacing, whole = std::pow(edge, D);
        const auto cubes_of = [&](const BodyPoints& of) {
            std::vector<std::array<std::int64_t, std::size_t(D)>> cubes;
            for (const Vec<double, D>& x : of.points) {
                std::array<std::int64_t, std::size_t(D)> cube;
                bool within = true;
                for (int a = 0; a < D; ++a) {
                    within = within && x[a] >= lower[a] - spacing / 2 && x[a] <= upper[a] + spacing / 2;
                    cube[std::size_t(a)] = within ? std::int64_t((x[a] - lower[a]) / edge + 0.125) : 0;
                }
                if (within) cubes.push_back(cube);
            }
            std::sort(cubes.begin(), cubes.end());
            const auto needed = std::size_t(std::ceil(0.6 * whole / std::pow(of.spacing, D)));
            std::size_t kept = 0;
            for (std::size_t i = 0, next; i < cubes.size(); i = next) {
                next = std::size_t(std::upper_bound(cubes.begin() + std::ptrdiff_t(i), cubes.end(), cubes[i]) -
                                   cubes.begin());
                if (next - i >= needed) cubes[kept++] = cubes[i];
            }
            cubes.resize(kept);
            return cubes;
        };
        const auto mine = cubes_of(*this), its = cubes_of(other);
        for (const auto& cube : its)
            if (std::binary_search(mine.begin(), mine.end(), cube)) {
                for (int a = 0; a < D; ++a) where[a] = lower[a] + (double(cube[std::size_t(a)]) + 0.375) * edge;
                return true;
            }
        return false;
    }
    std::string name() const {
        return sentence("that of the particles ", body.first, " to ", body.first + (body.count - 1), " of material ",
                        material);
    }
};

template <class Sets, class F>
void for_sets(const Sets& sets, const F& f) {
    std::apply([&](const auto&... set) { (f(set), ...); }, sets);
}

/// Calls f(k, slot) for every particle of a body that has some, the k-th in `bodies`, which are in the order of ids.
template <class Set, class F>
void for_bodies(const Set& set, const F& f) {
    for (std::size_t slot = 0; slot < set.particles.slots(); ++slot) {
        if (!set.particles.is_particle(slot)) continue;
        const auto next = std::upper_bound(set.bodies.begin(), set.bodies.end(), set.particles.id(slot),
                                           [](std::uint32_t id, const Body& body) { return id < body.first; });
        if (next != set.bodies.begin()) f(std::size_t(next - set.bodies.begin()) - 1, slot);
    }
}

/// A sentence about particles of bodies that are in a solid, more than a tenth of a cell deep; or nothing.
template <class Sets, class Boundary, int D>
[[gnu::cold]] std::string matter_in_solids(const Sets& sets, const Domain<D>& domain, const Boundary& boundary) {
    using S = typename std::tuple_element_t<0, Sets>::S;
    if constexpr (!has_surfaces<Boundary, S, D>) {
        return {};
    } else {
        std::size_t inside = 0, all = 0;
        double deepest = 0.1 * domain.cell_size;
        std::string where;
        for_sets(sets, [&](const auto& set) {
            for_bodies(set, [&](std::size_t, std::size_t slot) {
                double depth = 0;
                const Vec<double, D> x = set.particles.exact_position(slot);
                boundary.surfaces(cast<S>(x), [&](S distance, const auto&, const auto&, Contact contact, const auto&) {
                    if (contact != Contact::none) depth = std::max(depth, -double(distance));
                });
                ++all;
                inside += depth > 0.1 * domain.cell_size;
                if (!(depth > deepest)) return;
                deepest = depth;
                where = sentence("particle ", set.particles.id(slot), " at ", text_of(x), " m");
            });
        });
        if (inside == 0) return {};
        return sentence(inside, " of ", all, " particles lie inside a solid of the boundary, ", where,
                        " the deepest, by ", deepest,
                        " m: they are held there and do not come out. Move the body or the solid, or leave out such "
                        "positions before you add them.");
    }
}

/// Do walls hold matter at every face of the domain that is not periodic?
template <class Boundary, int D>
bool has_all_walls(const Boundary& boundary, const Domain<D>& domain) {
    bool has = false;
    if constexpr (requires { boundary.at_lower[D - 1].contact; }) {
        has = true;
        for (std::size_t a = 0; a < std::size_t(D); ++a)
            has = has && (domain.periodic[a] || (boundary.at_lower[a].contact != Contact::none &&
                                                 boundary.at_upper[a].contact != Contact::none));
    } else if constexpr (requires { boundary.parts; }) {
        std::apply([&](const auto&... part) { has = (has_all_walls(part, domain) || ...); }, boundary.parts);
    }
    return has;
}

/// A sentence about a particle that has come to the end of the domain; or nothing.
template <class Sets, int D>
[[gnu::cold]] std::string matter_at_the_end(const Sets& sets, const Domain<D>& domain) {
    std::string text;
    const double near = 1e-3 * domain.cell_size;
    for_sets(sets, [&](const auto& set) {
        for (std::size_t slot = 0; slot < set.particles.slots() && text.empty(); ++slot) {
            if (!set.particles.is_particle(slot)) continue;
            const Vec<double, D> x = set.particles.exact_position(slot);
            for (int a = 0; a < D; ++a) {
                if (domain.periodic[std::size_t(a)]) continue;
                if (x[a] > domain.lower[a] + near && x[a] < domain.upper[a] - near) continue;
                text =
                    sentence("particle ", set.particles.id(slot), " has come to the end of the domain, at ", text_of(x),
                             " m, where the boundary holds nothing: it stays there and gathers "
                             "momentum. A boundary that is given takes the place of the walls; to have both, give "
                             "firn::Together(firn::Walls<…>::all(…), …). What is to leave, takes out a sink.");
                break;
            }
        }
    });
    return text;
}

/// A sentence about two bodies that overlap; or nothing.
template <int D, class Sets>
[[gnu::cold]] std::string overlapping_bodies(const Sets& sets) {
    std::vector<BodyPoints<D>> all;
    std::vector<std::size_t> first_of_material;
    for_sets(sets, [&](const auto& set) {
        const std::size_t first = all.size(), material = first_of_material.size();
        first_of_material.push_back(first);
        for (std::size_t k = 0; k < set.bodies.size(); ++k) all.push_back({material, set.bodies[k]});
        for_bodies(set, [&](std::size_t k, std::size_t slot) {
            BodyPoints<D>& body = all[first + k];
            body.spacing = std::pow(double(set.particles.volume(slot)), 1.0 / D);
            const Vec<double, D> x = set.particles.exact_position(slot);
            for (int a = 0; a < D; ++a) {
                body.lower[a] = std::min(body.lower[a], x[a]);
                body.upper[a] = std::max(body.upper[a], x[a]);
            }
        });
    });
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < all.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (all[i].spacing > 0 && all[j].spacing > 0 && all[i].meets(all[j])) {
                all[i].has_neighbours = all[j].has_neighbours = true;
                pairs.emplace_back(i, j);
            }
    if (pairs.empty()) return {};
    std::size_t material = 0;
    for_sets(sets, [&](const auto& set) {
        const std::size_t first = first_of_material[material++];
        for_bodies(set, [&](std::size_t k, std::size_t slot) {
            BodyPoints<D>& body = all[first + k];
            if (body.has_neighbours) body.points.push_back(set.particles.exact_position(slot));
        });
    });
    for (const auto& [i, j] : pairs)
        if (Vec<double, D> where{}; all[i].overlaps(all[j], where))
            return sentence("two bodies overlap around ", text_of(where), " m, ", all[j].name(), " and ", all[i].name(),
                            ": their matter is there twice, and will burst apart. Move one of them, or leave out "
                            "the positions that lie in both.");
    return {};
}

/// What a run has been warned of.
class Warnings {
public:
    /// Of the bound of the time step [s]: that it has fallen far, or is very small; or nothing.
    /// \param reason  reason(): what the bound comes from, in a sentence
    template <class Reason>
    std::string of_bound(double bound, std::uint64_t step, double time, const Reason& reason) {
        largest_ = std::max(largest_, bound);
        if (bound >= 1e-6 && bound >= 1e-3 * largest_) return {};
        return of_small_bound(bound, step, time, reason);
    }

    /// Of a fixed time step [s] above the bound; nothing where it has been of about that ratio.
    template <class Warn>
    std::string of_step(double fixed, double bound, std::uint64_t step, const Warn& warn) {
        const double ratio = fixed / bound;
        if (ratio < 1.2 * said_ratio_) return {};
        said_ratio_ = ratio;
        if (!warn) return {};
        return sentence("the fixed time step of ", fixed, " s is ", ratio, " times the bound of ", bound, " s at step ",
                        step, "; the simulation may become unstable.");
    }
    /// Of matter at an end of the domain that no wall holds, looked for every 32 steps.
    template <class Sets, int D, class Boundary>
    std::string of_the_end(const Sets& sets, const Domain<D>& domain, const Boundary& boundary, std::uint64_t step) {
        if (end_said_ || step % 32 != 0 || has_all_walls(boundary, domain)) return {};
        std::string text = matter_at_the_end(sets, domain);
        end_said_ = !text.empty();
        return text;
    }
    /// Of samples, when they are added.
    /// \param warn  takes the warning; may be empty
    template <int D, class Warn>
    void of_spacing(const Samples<D>& samples, const Domain<D>& domain, const Warn& warn) {
        if (!warn || spacing_said_) return;
        const std::string text = wide_spacing(samples, domain.cell_size);
        spacing_said_ = !text.empty();
        if (!text.empty()) warn(text);
    }
    /// Of bodies and walls, before the first step.
    template <class Sets, int D, class Boundary, class Warn>
    void of_start(const Sets& sets, const Domain<D>& domain, const Boundary& boundary, const Warn& warn) {
        if (!warn || started_) return;
        started_ = true;
        for (const std::string& text :
             {other_walls(boundary, domain), matter_in_solids(sets, domain, boundary), overlapping_bodies<D>(sets)})
            if (!text.empty()) warn(text);
    }

private:
    template <class Reason>
    [[gnu::cold]] std::string of_small_bound(double bound, std::uint64_t step, double time, const Reason& reason) {
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

    double largest_ = 0, said_ratio_ = 1 / 1.2;
    bool fallen_said_ = false, small_said_ = false, started_ = false, spacing_said_ = false, end_said_ = false;
};

}  // namespace firn::detail
