/// \file Makes a complete WGSL program from the policies of a simulation (kernel, transfer, material, …).
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/contact/one_field.hpp>
#include <firn/field/gravity.hpp>
#include <firn/transfer/concept.hpp>
#include <firn/version.hpp>
#include <firn/volumetric/own_volume.hpp>
#include <firn/wgsl/definitions.hpp>
#include <firn/wgsl/manifest.hpp>
#include <firn/wgsl/material_definitions.hpp>
#include <firn/wgsl/text.hpp>

namespace firn::inline FIRN_BUILD::wgsl {

namespace detail {

inline std::string name_of(const Program& program) {
    std::string name = std::to_string(program.dimension) + "d";
    for (const std::string* policy :
         {&program.kernel, &program.transfer, &program.force, &program.material, &program.boundary, &program.field})
        name += "_" + *policy;
    if (!program.volume.empty()) name += "_" + program.volume;
    if (program.options.grid == GridStorage::sparse) name += "_sparse";
    if (program.options.periodic) name += "_periodic";
    if (program.options.arithmetic == Arithmetic::exact) name += "_exact";
    return name;
}

inline void add_uniforms(UniformLayout& uniforms, int dimension, const ProgramOptions& options) {
    const std::string of_u32 = "vec" + std::to_string(dimension) + "<u32>",
                      of_f32 = "vec" + std::to_string(dimension) + "<f32>";
    const std::vector<double> zero(std::size_t(dimension), 0.0);
    uniforms.add("nodes", of_u32, "1", "nodes along each axis, a multiple of 4", zero);
    uniforms.add("particles", "u32", "1", "number of particles", {0});
    uniforms.add("cells", of_f32, "cells", "extent of the domain", zero);
    uniforms.add("capacity", "u32", "1", "distance between two numbers of a particle", {0});
    uniforms.add("time_step", "f32", "s", "dt; the longest, with bound_time_step", {0});
    uniforms.add("cell_size", "f32", "m", "h", {0});
    uniforms.add("place_per_velocity", "f32", "s/m", "dt / h, rounded once", {0});
    uniforms.add("momentum_scale", "f32", "s/(kg m)", "quanta per momentum, a power of two; 0: chosen", {0});
    uniforms.add("mass_scale", "f32", "1/kg", "quanta per mass, a power of two; 0: chosen", {0});
    uniforms.add("bound_time_step", "u32", "1",
                 "1: no step is longer than the stable one; 2: nor longer than the time left", {0});
    uniforms.add("set_number", "u32", "1", "number of this set of particles, of those on one grid", {0});
    uniforms.add("least_time_left", "f32", "s",
                 "with bound_time_step 2, if positive: no step is taken that leaves less", {0});
    uniforms.add("first_particle", "u32", "1", "index of particle 0 of this buffer in its set of particles", {0});
    uniforms.add("boundary_speed", "f32", "m/s", "largest speed of the boundary, for bound_time_step", {0});
    if (options.grid == GridStorage::sparse) uniforms.add("blocks", "u32", "1", "most blocks of 4^D nodes", {0});
    if (options.periodic) {
        uniforms.add("period", of_u32, "cells", "extent of the domain along periodic axes; 0 along others", zero);
        uniforms.add("lowest", of_f32, "cells", "lower corner of the box in which a step keeps particles", zero);
        uniforms.add("highest", of_f32, "cells", "upper corner of this box", zero);
    }
    if (options.arithmetic == Arithmetic::exact)
        uniforms.add("negative_zero", "f32", "1", "a zero that drivers do not know", {-0.0});
}

/// Sets the room between the walls of the program, and adds the uniforms of particle shifting.
template <int D, class Boundary>
void add_room(Program& program, UniformLayout& uniforms, const Boundary& boundary) {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    RoomBox<D> room{Vec<double, D>::filled(-infinite), Vec<double, D>::filled(infinite)};
    narrow_to_walls(room, boundary);
    program.room_lower.assign(room.lower.v, room.lower.v + D);
    program.room_upper.assign(room.upper.v, room.upper.v + D);
    const std::string of_f32 = "vec" + std::to_string(D) + "<f32>";
    const std::vector<double> zero = std::vector<double>(std::size_t{D}, 0.0);
    uniforms.add("room_lower", of_f32, "cells", "lower corner of the room between walls, from that of the domain",
                 zero);
    uniforms.add("room_upper", of_f32, "cells", "upper corner of the room between walls, from that of the domain",
                 zero);
    uniforms.add("domain_lower", of_f32, "m", "lower corner of the domain", zero);
    uniforms.add("per_volume", "f32", "1/m^D", "1 / h^D, rounded once", {0});
}

/// Sets the mirrored walls of the program.
template <class Boundary>
void set_mirrors(Program& program, const Boundary& boundary) {
    if constexpr (has_mirrors<Boundary>)
        boundary.mirrors([&](int axis, auto position, int inward, Contact contact, double friction, int part) {
            program.mirrors.push_back({double(position), {axis, 0, inward, contact, friction, part}});
        });
}

/// Returns true if there is a WGSL program with these policies. If there is none, the compilation stops with a message.
template <class Kernel, class Transfer, int D, class Material, class Boundary, class Field, class Volume>
consteval bool require_program() {
    static_assert(require_material<Material, D>() && require_kernel<Kernel>() && require_transfer<Transfer>());
    static_assert(firn::detail::require_offers<recorded, D>(std::type_identity<Boundary>{}) || true);
    static_assert(firn::detail::require_acceleration<Field, recorded, D>() || true);
    static_assert(!(refines_velocities<Transfer> && blends_velocities<Transfer>),
                  "firn: a transfer that refines velocities by a series and blends them, too, is not in WGSL.");
    static_assert(!acts_by_gap<Boundary>,
                  "firn: boundaries that act by the gap of particles (GapContact) are not yet in WGSL; give the walls "
                  "and colliders themselves.");
    static_assert(Volume::averages_volume || filters_volume<Volume> || std::same_as<Volume, OwnVolume>,
                  "firn: this volumetric policy is not yet in WGSL; there are OwnVolume, FBar and VolumeFilter.");
    static_assert(!(Volume::averages_volume && filters_volume<Volume>),
                  "firn: a volumetric policy that averages and filters is not yet in WGSL.");
    static_assert(!Volume::averages_volume || !tells_plastic_volume<material_state_t<Material, D>>,
                  "firn: FBar with PlasticVolume is not yet in WGSL; run it on the CPU.");
    static_assert(Kernel::support <= block_size,
                  "one block of ghost nodes holds all nodes beyond the domain that a particle reaches");
    return true;
}

/// Returns an empty program with the names of its policies.
template <class Kernel, class Transfer, class Force, int D, class Material, class Boundary, class Field, class Volume>
Program named_program(const ProgramOptions& options) {
    Program program;
    program.options = options;
    program.dimension = D;
    program.kernel = Kernel::name;
    program.transfer = Transfer::name;
    program.force = Force::name;
    program.material = Material::name;
    program.boundary = Boundary::name;
    program.field = Field::name;
    if constexpr (!std::same_as<Volume, OwnVolume>) program.volume = Volume::name;
    program.name = name_of(program);
    return program;
}

/// Returns the WGSL functions and structs of the policies.
template <class Kernel, class Transfer, class Force, int D, class Material, class Boundary, class Field, class Volume>
Module definitions_of(const Program& program, const Facts& facts, const Material& material, const Boundary& boundary,
                      const Field& field, const Volume& volume, const Transfer& transfer) {
    Module module(program.options.arithmetic);
    add_kernel<Kernel, D>(module, facts.sum_gradients || facts.shifts_particles);
    add_time_step<Kernel>(module);
    if (facts.keeps_time()) add_time(module);
    add_p2g<Kernel, Transfer, Force, D>(module);
    if (program.options.loads > 0) add_push<D>(module);
    if (facts.reacting_parts > 0)
        add_reactions<D>(module, boundary, field);
    else
        add_grid_update<D>(module, boundary, field);
    add_acceleration<D>(module, field);
    if constexpr (has_mirrors<Boundary>) {
        std::vector<MirrorPlane> walls;
        for (const MirroredWall& wall : program.mirrors) walls.push_back(wall.plane);
        add_mirrors<Kernel, D>(module, boundary, walls, facts.blends || facts.refinements > 0);
    }
    add_g2p<Kernel, Transfer, Force, D>(module, transfer, program.options.periodic);
    if constexpr (blends_velocities<Transfer> || refines_velocities<Transfer>)
        if (facts.blends || facts.refinements > 0) add_before_forces<Kernel, Transfer, D>(module);
    if constexpr (blends_velocities<Transfer>) add_blend<Transfer, D>(module, transfer);
    if constexpr (refines_velocities<Transfer>)
        if (facts.refinements > 0) add_series<Transfer, D>(module, facts.mirrors);
    add_material<D>(module, material);
    if constexpr (!std::same_as<Volume, OwnVolume>) add_volume_average<Kernel, D>(module);
    if constexpr (Volume::averages_volume) add_averaged_volume<D>(module, volume);
    if constexpr (filters_volume<Volume>) add_filtered_volume<D>(module, material, volume);
    if constexpr (shifts_particles<Volume> && has_volume_ratio<material_state_t<with_scalar_t<Material, recorded>, D>>)
        if (facts.shifts_particles) add_shifting<Kernel, D>(module, boundary, material, volume);
    return module;
}

/// Returns whether a boundary has mirrored walls.
template <class Boundary>
bool has_mirrored_walls(const Boundary& boundary) {
    bool has = false;
    if constexpr (has_mirrors<Boundary>) boundary.mirrors([&](auto&&...) { has = true; });
    return has;
}

/// Returns whether the policy shifts the particles of a material.
template <class Material, int D, class Volume>
bool shifts(const Volume& volume) {
    if constexpr (shifts_particles<Volume> && has_volume_ratio<material_state_t<with_scalar_t<Material, recorded>, D>>)
        return volume.shifted_share(1.0) > 0;
    else
        return false;
}

}  // namespace detail

/// Returns whether a program of these policies can have a sparse grid: not if it shifts particles.
template <class Material, int D, class Volume>
bool can_be_sparse(const Volume& volume) {
    return !detail::shifts<Material, D>(volume);
}

/// Makes the WGSL program of a simulation with the given policies: kernel, transfer, force, material, boundary,
/// acceleration field and volumetric policy.
///
/// The parameters of the policies become uniforms of the program, which the host can change between steps: the blend
/// of a transfer of your own, for example. Other members of the policies, such as the contact of a wall, become fixed
/// parts of the program's text; so do the parameters of a volumetric policy and of FMPM. A filter of volume ratios
/// counts the steps since the host set the status to 0.
///
/// Mirrored walls must lie on planes of nodes. make_inputs() checks this, because the program does not know its domain;
/// if the host moves a wall to another place, the next step reports an error. \see NodesBehind::mirrored
/// \tparam Kernel          the kernel, such as QuadraticBSpline
/// \tparam Transfer        the transfer: Pic, Apic, Flip, Aflip, Asflip or Fmpm
/// \tparam Force           the force form (how P2G computes forces from stress), such as MlsForce
/// \param transfer         the transfer with its parameters, which become uniforms but for the order of FMPM
/// \throws parameter_error  if a parameter of `boundary`, `volume` or `transfer` is not valid
/// \throws usage_error      if the grid cannot be sparse (\see can_be_sparse), or if it must be, for periodic axes; or
///                          if particles of one of several sets would be shifted
template <class Kernel, class Transfer, class Force, int D, class Material, class Boundary, class Field,
          volumetric Volume>
Program make_program(const Material& material, const Boundary& boundary, const Field& field, const Volume& volume,
                     const ProgramOptions& options = {}, const Transfer& transfer = {}) {
    static_assert(detail::require_program<Kernel, Transfer, D, Material, Boundary, Field, Volume>());
    using State = material_state_t<with_scalar_t<Material, recorded>, D>;
    static_assert(std::tuple_size_v<decltype(State::fields())> > 0, "firn: a struct of WGSL has at least one member");
    if constexpr (requires { transfer.check(); }) transfer.check();
    int every = 0;
    if constexpr (filters_volume<Volume>) {
        static_assert(has_volume<State>, "firn: a filter of volume ratios needs a material with a state J or F.");
        volume.check();
        every = volume.every;
    }
    const bool shifts = detail::shifts<Material, D>(volume);
    const bool sparse = options.grid == GridStorage::sparse;
    if (sparse && !can_be_sparse<Material, D>(volume))
        throw usage_error("In WGSL, particle shifting needs a dense grid.");
    if (shifts && options.several_sets)
        throw usage_error("In WGSL, particle shifting is for one material: set VolumeFilter::shifting to 0.");
    if (options.periodic && !sparse) throw usage_error("In WGSL, periodic axes need a sparse grid.");
    const int parts = options.reactions ? part_count(boundary) : 0;
    if (parts > most_reacting_parts)
        throw usage_error(sentence("In WGSL, there are reactions of at most ", most_reacting_parts,
                                   " parts of a boundary; this one has ", parts, "."));
    const Facts facts{D,
                      Kernel::support,
                      centre_node<Kernel>,
                      Transfer::affine,
                      Force::weight_gradients,
                      g2p_needs_gradient<Kernel, Transfer, Force>,
                      blends_velocities<Transfer>,
                      detail::refinements_of(transfer),
                      has_rate_dependent_stress<Material, D>,
                      has_stress_with_state<Material, D>,
                      Volume::averages_volume,
                      filters_volume<Volume>,
                      every,
                      shifts,
                      sparse,
                      parts,
                      detail::has_mirrored_walls(boundary),
                      program_asks<Material, D>,
                      options};

    Program program = detail::named_program<Kernel, Transfer, Force, D, Material, Boundary, Field, Volume>(options);
    program.time_step_safety = time_step_safety<Kernel>;
    program.acceleration_safety = acceleration_safety;
    program.refinements = facts.refinements;
    program.keeps_time = facts.keeps_time();

    detail::UniformLayout uniforms(program);
    detail::add_uniforms(uniforms, D, options);
    uniforms.add_policy(material, "material");
    uniforms.add_policy(boundary, "boundary");
    uniforms.add_policy(field, "field");
    if constexpr (!refines_velocities<Transfer>) uniforms.add_policy(transfer, "transfer");
    if (shifts) detail::add_room<D>(program, uniforms, boundary);
    if (facts.asks)
        uniforms.add(detail::corner_uniform, "vec" + std::to_string(D) + "<f32>", "m",
                     "lower corner of the domain, for the material", std::vector<double>(std::size_t{D}, 0.0));
    if (options.loads > detail::most_loads)
        throw usage_error(sentence("In WGSL, a set of particles has at most ", detail::most_loads, " loads, not ",
                                   options.loads, "."));
    for (int k = 0; k < options.loads; ++k)
        uniforms.add("load_" + std::to_string(k), "vec" + std::to_string(D) + "<f32>", "N",
                     "force of a load on each particle of its body", std::vector<double>(std::size_t{D}, 0.0));
    if (facts.loads_react()) {
        const std::string type = "vec" + std::to_string(D) + "<f32>";
        const std::vector<double> zero(std::size_t{D}, 0.0);
        uniforms.add("load_about_cell", type, "cells",
                     "point about which the angular impulses of loads are taken, from the domain's corner: cell", zero);
        uniforms.add("load_about_rest", type, "cells", "where in this cell it is", zero);
        uniforms.add("load_per_arm", "f32", "1/cell", "a power of two, at most one half over the largest arm", {0});
    }
    if (facts.reacting_parts > 0)
        uniforms.add("per_arm", "f32", "1/m", "a power of two, at most one half over the largest arm", {0});
    for (int k = 0; k < facts.reacting_parts; ++k)
        uniforms.add("about_" + std::to_string(k), "vec" + std::to_string(D) + "<f32>", "m",
                     "point about which the angular impulses of a part of the boundary are taken",
                     std::vector<double>(std::size_t{D}, 0.0));
    for (int k = 0; k < options.sinks; ++k)
        for (const char* end : {"_lower", "_upper"})
            uniforms.add("sink_" + std::to_string(k) + end, "vec" + std::to_string(D) + "<f32>", "cells",
                         "corner of a sink, from that of the domain", std::vector<double>(std::size_t{D}, 0.0));
    program.uniform_bytes = (program.uniform_bytes + 15) / 16 * 16;
    const FieldTable table = field_table<float, D, material_state_t<Material, D>>();
    detail::add_buffers(program, facts, table);
    detail::set_mirrors(program, boundary);
    detail::set_start(program, initial_state<D>(material));
    detail::add_entry_points(program, facts);

    const Module module =
        detail::definitions_of<Kernel, Transfer, Force, D>(program, facts, material, boundary, field, volume, transfer);
    const detail::KernelText text(facts);
    program.code = "// Written by firn " + version() +
                   " from the definitions that run on the CPU: change those, not this.\n// " + program.name + "\n\n" +
                   detail::declarations(program) + "\n" + module.text() + text.helpers() + "\n" +
                   detail::particle_accessors<D, State>(program, table, facts.affine) + text.entry_points(program);
    return program;
}

/// This overload does not compile: the compiler prints a message that there are no WGSL kernels for contact groups.
template <class Kernel, class Transfer, class Force, int D, class Material, class Boundary, class Field, class Law>
    requires(contact_law<Law> && !std::same_as<Law, OneField>)
Program make_program(const Material&, const Boundary&, const Field&, const Law&, const ProgramOptions& = {}) {
    static_assert(!contact_law<Law>,
                  "firn: contact between groups of bodies is not yet in WGSL; there is only the default, OneField.");
    return {};
}

/// As make_program() with a volumetric policy, without an average of volume changes.
template <class Kernel, class Transfer, class Force, int D, class Material, class Boundary,
          class Field = Gravity<float, D>>
Program make_program(const Material& material, const Boundary& boundary, const Field& field = {},
                     const ProgramOptions& options = {}, const Transfer& transfer = {}) {
    return make_program<Kernel, Transfer, Force, D>(material, boundary, field, OwnVolume{}, options, transfer);
}

}  // namespace firn::inline FIRN_BUILD::wgsl
