/// \file The surface of a simulation's particles: of a material, or of one of its bodies. In three dimensions.
///
///     auto surface = firn::surface_of(simulation, {.smoothing = 4}, {"velocity"});
///     firn::write_ply("water_0001.ply", surface);  // firn/io/surface.hpp
///
/// What the set carries decides what is known of a particle. The F of an elastic material is its whole deformation, and
/// deforms the particle's kernel. Of a fluid, J is known. Of plastic matter, F is the elastic part only: det F, times
/// the plastic volume if the material keeps it (snow, clay), gives the volume, and the other particles give the shape.
/// Of a run on many ranks, these are the particles of the calling rank: its surface is closed where its particles end.
/// \see firn/data/surface.hpp
#pragma once

#include <firn/data/surface.hpp>
#include <firn/simulation/body.hpp>
#include <firn/simulation/stretch.hpp>

#include <optional>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Particles of a store, as arrays in the order of ids.
struct ArraysForSurface {
    std::vector<std::uint32_t> id;
    std::vector<Vec<double, 3>> positions;
    std::vector<double> volumes;
    std::vector<Mat<double, 3>> deformation_gradients;
    std::vector<SurfaceField> fields;
};

/// Copies what the surface of particles needs.
/// \param body     if given, only its particles are copied
/// \param elastic  whether F is the whole deformation
/// \param most     by how much volumes are believed to change
/// \throws parameter_error  if the store has no field of a name, or no particle
template <std::floating_point S>
[[gnu::cold]] ArraysForSurface arrays_for_surface(const ParticleStore<S, 3>& particles, const std::optional<Body>& body,
                                                  bool elastic, double most, const std::vector<std::string>& names,
                                                  int threads) {
    const FieldTable& table = particles.table();
    ArraysForSurface result;
    std::vector<std::size_t> wanted;
    for (const std::string& name : names) {
        const std::size_t f = field_index(table, name);
        if (f == table.size() || f == ParticleStore<S, 3>::place_field) {
            std::string all;
            for (std::size_t k = 0; k < table.size(); ++k)
                if (k != ParticleStore<S, 3>::place_field) all += sentence(all.empty() ? "" : ", ", table[k].name);
            throw parameter_error(sentence("The particles have no field '", name, "'; they have: ", all, "."));
        }
        wanted.push_back(f);
        result.fields.push_back({name, table[f].unit, table[f].components_in_state(3), {}});
    }
    auto slots = slots_by_id(particles, threads);
    if (body) std::erase_if(slots, [&](std::uint32_t slot) { return !body->holds(particles.id(slot)); });
    if (slots.empty()) throw parameter_error("The set or body has no particles, so it has no surface.");

    const std::size_t of_F = field_index(table, "deformation_gradient"), of_J = field_index(table, "volume_ratio"),
                      of_plastic = field_index(table, "plastic_volume"),
                      of_log_plastic = field_index(table, "plastic_log_volume"), none = table.size();
    const std::size_t n = slots.size();
    result.id.resize(n), result.positions.resize(n), result.volumes.resize(n);
    if (elastic && of_F != none) result.deformation_gradients.resize(n);
    for (auto& field : result.fields) field.values.resize(n * std::size_t(field.components));
    for_chunks(n, threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k) {
            const std::size_t slot = slots[k];
            const auto number = [&](std::size_t field) {
                S value;
                particles.get(field, slot, &value);
                return double(value);
            };
            result.id[k] = particles.id(slot);
            result.positions[k] = particles.exact_position(slot);
            double ratio = 1;
            if (of_J != none) ratio *= number(of_J);
            if (of_plastic != none) ratio *= number(of_plastic);
            if (of_log_plastic != none) ratio *= std::exp(number(of_log_plastic));
            if (of_F != none) {
                std::array<S, 9> rows;
                particles.get(of_F, slot, rows.data());
                Mat<double, 3> F;
                for (int i = 0; i < 9; ++i) F(i / 3, i % 3) = double(rows[std::size_t(i)]);
                if (result.deformation_gradients.empty())
                    ratio *= determinant(F);
                else
                    result.deformation_gradients[k] = F;
            }
            // A NaN stays one, and is refused.
            result.volumes[k] =
                double(particles.volume(slot)) * (ratio == ratio ? std::clamp(ratio, 1 / most, most) : ratio);
            std::array<S, 9> numbers;
            for (std::size_t f = 0; f < wanted.size(); ++f) {
                const auto components = std::size_t(result.fields[f].components);
                particles.get(wanted[f], slot, numbers.data());
                for (std::size_t c = 0; c < components; ++c)
                    result.fields[f].values[components * k + c] = double(numbers[c]);
            }
        }
    });
    return result;
}

template <class Set>
SurfaceMesh surface_of_part(const Set& set, const std::optional<Body>& body, const SurfaceOptions& options,
                            const std::vector<std::string>& fields) {
    using Material = std::remove_cvref_t<decltype(set.material())>;
    []<std::floating_point S, int D>(const ParticleStore<S, D>&) {
        static_assert(D == 3, "firn: surfaces are computed in three dimensions only.");
    }(set.particles());
    check_surface_options(options);
    const auto arrays = arrays_for_surface(set.particles(), body, is_elastic<Material, 3>, options.largest_stretch,
                                           fields, options.threads);
    SurfaceMesh surface =
        surface_of({arrays.positions, arrays.volumes, arrays.deformation_gradients, arrays.fields}, options);
    for (auto& index : surface.alone) index = arrays.id[index];
    return surface;
}

}  // namespace detail

/// A set of a simulation, or a simulation with one material: it has particles and bodies of a material.
template <class Set>
concept set_of_particles = requires(const Set& set) {
    set.particles();
    set.material();
    set.bodies();
};

/// Returns the surface of all particles of a set. \see firn/data/surface.hpp
/// \param set      `simulation.set<I>()`, or a simulation with one material
/// \param fields   names of particles' fields that the surface carries, such as "velocity"; matrices row by row
/// \throws parameter_error  if the set is empty or has no such field, or as surface_of(particles)
/// \throws particle_error, memory_error  as surface_of(particles)
template <set_of_particles Set>
SurfaceMesh surface_of(const Set& set, const SurfaceOptions& options = {},
                       const std::vector<std::string>& fields = {}) {
    return detail::surface_of_part(set, std::nullopt, options, fields);
}
/// Returns the surface of the particles of one body.
/// \throws parameter_error  if none of them is there, or as surface_of(set)
template <set_of_particles Set>
SurfaceMesh surface_of(const Set& set, const Body& body, const SurfaceOptions& options = {},
                       const std::vector<std::string>& fields = {}) {
    return detail::surface_of_part(set, body, options, fields);
}

}  // namespace firn::inline FIRN_BUILD
