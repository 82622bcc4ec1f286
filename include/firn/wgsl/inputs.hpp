/// \file Makes the initial contents of a WGSL program's uniforms and buffers from particles on the CPU.
#pragma once

#include <firn/core/parameters.hpp>
#include <firn/data/particles.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/stage/fixed_point.hpp>
#include <firn/wgsl/limits.hpp>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

namespace firn::inline FIRN_BUILD::wgsl {

/// The values that a host (the software that starts a program) writes into the uniforms and buffers of the program
/// before the program runs.
class Inputs {
public:
    /// Sets all uniforms to their default values. `program` must exist as long as this object exists.
    explicit Inputs(const Program& program) : program_(&program) {
        for (const Uniform& u : program.uniforms) values_.push_back(u.values);
    }

    std::uint32_t particles = 0;       ///< number of particles
    std::vector<std::uint32_t> nodes;  ///< number of nodes along each axis of the grid
    std::uint32_t blocks = 0;          ///< for a sparse grid: number of blocks for which it has memory; else 0
    /// The name and the contents of each buffer that the host must fill before the first step. The contents have the
    /// same order as on the device: in a buffer with values of particles, the c-th value (from 0) of particle i is at
    /// index c * capacity + i, where capacity is the uniform of this name.
    std::vector<std::pair<std::string, std::vector<float>>> buffers;

    /// Sets the components of a uniform.
    /// \throws usage_error  if the program has no uniform of this name, or if `values` has more or fewer components
    ///                      than the uniform
    void set(const std::string& name, const std::vector<double>& values) {
        const Uniform& u = program_->uniform(name);
        if (values.size() != u.values.size())
            throw usage_error(sentence("The uniform ", name, " has ", u.values.size(), " components; ", values.size(),
                                       " were given."));
        values_[std::size_t(&u - program_->uniforms.data())] = values;
    }
    /// Returns the components of the uniform Program::uniforms[k].
    const std::vector<double>& uniform(std::size_t k) const { return values_[k]; }
    /// Returns the values of all uniforms as the bytes of the buffer at binding 0.
    std::vector<std::byte> uniform_bytes() const {
        std::vector<std::byte> bytes(program_->uniform_bytes);
        for (std::size_t k = 0; k < values_.size(); ++k) {
            const Uniform& u = program_->uniforms[k];
            const bool whole = u.type.find("u32") != std::string::npos;
            for (std::size_t i = 0; i < values_[k].size(); ++i) {
                const double x = values_[k][i];
                const std::uint32_t bits = whole ? std::uint32_t(x) : std::bit_cast<std::uint32_t>(float(x));
                std::memcpy(bytes.data() + u.offset + 4 * i, &bits, sizeof bits);
            }
        }
        return bytes;
    }

private:
    const Program* program_;
    std::vector<std::vector<double>> values_;
};

/// Sets the uniform "time_step" to dt and the uniform "place_per_velocity" to dt / h.
/// \param dt         time step [s]
/// \param cell_size  cell size h of the domain [m]
inline void set_time_step(Inputs& inputs, double dt, double cell_size) {
    inputs.set("time_step", {dt});
    inputs.set("place_per_velocity", {dt / cell_size});
}

/// Calls f(name, numbers) for each parameter of a policy: its name, and its components as doubles.
template <class Policy, class F>
void for_numbers_of(const Policy& policy, const std::string& prefix, const F& f) {
    for_parameters(
        policy,
        [&](const std::string& name, const char*, const auto& value) { f(name, firn::detail::as_doubles(value)); },
        prefix + "_");
}

/// Sets the uniforms of a policy (a material, a boundary or an acceleration field) to the policy's present parameters,
/// for example after a boundary has moved. Grids of distances stay what they are: make the program again for others.
/// \param policy  the policy, of the type for which the program was made
/// \param prefix  which policy it is: "material", "boundary" or "field"
/// \throws usage_error  if the program has no uniform for one of the policy's parameters
template <class Policy>
void set_parameters(Inputs& inputs, const Policy& policy, const std::string& prefix) {
    for_numbers_of(policy, prefix,
                   [&](const std::string& name, const std::vector<double>& numbers) { inputs.set(name, numbers); });
}

/// Which of the particles a program gets, of all in the order of their slots.
struct Share {
    std::size_t first = 0;                                        ///< how many come before
    std::size_t count = std::numeric_limits<std::size_t>::max();  ///< how many it gets, at most
};

namespace detail {

/// A boundary that consists of the mirrored walls of a program.
struct WallsOfProgram {
    const Program& program;
    template <class Seen>
    void mirrors(const Seen& seen) const {
        for (const auto& [position, wall] : program.mirrors)
            seen(wall.axis, float(position), wall.inward, wall.contact, wall.friction, wall.part);
    }
};

/// Sets the uniforms of the room that particles may be shifted to, as RoomOfDomain has it.
template <int D>
void set_room(Inputs& inputs, const Program& program, const Domain<D>& domain) {
    std::vector<double> low, high, lower;
    for (std::size_t a = 0; a < std::size_t(D); ++a) {
        const double from = domain.lower[int(a)], h = domain.cell_size;
        low.push_back((std::max(from, program.room_lower[a]) - from) / h);
        high.push_back((std::min(domain.upper[int(a)], program.room_upper[a]) - from) / h);
        lower.push_back(from);
    }
    inputs.set("room_lower", low), inputs.set("room_upper", high), inputs.set("domain_lower", lower);
    inputs.set("per_volume", {std::pow(domain.cell_size, -D)});
}

/// Sets what a material that asks for the surroundings of particles has to know of the domain.
template <int D>
void set_corner(Inputs& inputs, const Program& program, const Domain<D>& domain) {
    if (program.has_uniform(corner_uniform)) inputs.set(corner_uniform, {domain.lower.v, domain.lower.v + D});
}

/// Sets the uniforms of periodic axes.
template <int D>
void set_periods(Inputs& inputs, const Domain<D>& domain) {
    std::vector<double> period, lowest, highest;
    for (int a = 0; a < D; ++a) {
        const auto range = range_of_steps<float>(domain, a);
        period.push_back(domain.periodic[std::size_t(a)] ? domain.cells(a) : 0);
        lowest.push_back(double(range[0]));
        highest.push_back(double(range[1]));
    }
    inputs.set("period", period), inputs.set("lowest", lowest), inputs.set("highest", highest);
}

/// Calls f(component, k, field) for each number that a buffer has of a particle, in their order: component k of a
/// field, whose index in the table is `field`. Two are no fields: table.size() is the corner of a particle's block,
/// table.size() + 1 its place before the step.
template <class F>
void for_numbers_in(const Buffer& buffer, const FieldTable& table, const F& f) {
    for (const Component& component : buffer.components) {
        const auto is_it = [&](const FieldInfo& field) { return field.name == component.name; };
        const bool is_before = component.name == place_before;
        const auto field =
            is_before ? table.size() + 1 : std::size_t(std::ranges::find_if(table, is_it) - table.begin());
        for (int k = 0; k < component.count; ++k) f(k, field);
    }
}

/// Returns the slots of particles, in the order that they have in a program.
template <int D>
std::vector<std::size_t> slots_of(const ParticleStore<float, D>& particles, const Share& share = {}) {
    std::vector<std::size_t> slots;
    std::size_t before = 0;
    for (std::size_t slot = 0; slot < particles.slots() && slots.size() < share.count; ++slot)
        if (particles.is_particle(slot) && before++ >= share.first) slots.push_back(slot);
    return slots;
}

/// Checks that masses, and volumes if the program sums them, are far above the quanta of the sums.
/// \throws particle_error  if one is not
template <int D, class State>
void check_heavy_enough(const Program& program, const Particles<float, D, State>& particles,
                        const std::vector<std::size_t>& slots) {
    for (const std::size_t slot : slots)  // on the CPU, fixed_point_scale() makes a more precise check
        if (!(particles.mass(slot) >= 0x1p-86F))
            throw particle_error(sentence("Particle ", particles.id(slot), " has a mass of ", particles.mass(slot),
                                          " kg; on a GPU, particles lighter than ", 0x1p-86,
                                          " kg move in coarse steps. Use units in which masses are larger."));
    if (program.volume.empty()) return;
    for (const std::size_t slot : slots)
        if (!(particles.volume(slot) >= 0x1p-86F))
            throw particle_error(sentence("Particle ", particles.id(slot), " has a volume of ", particles.volume(slot),
                                          " m^", D, "; on a GPU, ", program.volume, " needs at least ", 0x1p-86,
                                          ". Use units in which volumes are larger."));
}

/// Returns the positions of the nodes along each axis [m], with the same roundings as in the CPU's grid update.
template <int D, class Nodes>
std::vector<float> node_coordinates(const Domain<D>& domain, const Nodes& nodes) {
    std::vector<float> coordinates;
    for (int a = 0; a < D; ++a)
        for (int i = 0; i < int(nodes[std::size_t(a)]); ++i) {
            BlockCoordinate<D> block{};
            block[std::size_t(a)] = i / block_size - 1;
            const float first = float(position_of_place(domain, block, a, 0));
            coordinates.push_back(first + float(i % block_size) * float(domain.cell_size));
        }
    return coordinates;
}

}  // namespace detail

/// Returns how many blocks of nodes are at most one block along each axis away from the blocks of particles.
template <int D, class State>
std::size_t blocks_near(const Particles<float, D, State>& particles) {
    std::vector<BlockCoordinate<D>> blocks;
    const auto leave_unique = [&] {
        std::ranges::sort(blocks);
        blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    };
    for (const std::size_t slot : detail::slots_of<D>(particles))
        if (blocks.empty() || blocks.back() != particles.block(slot)) blocks.push_back(particles.block(slot));
    leave_unique();
    for (std::size_t a = 0; a < std::size_t(D); ++a) {
        const std::vector<BlockCoordinate<D>> before = blocks;
        for (BlockCoordinate<D> block : before) {
            --block[a], blocks.push_back(block);
            block[a] += 2, blocks.push_back(block);
        }
        leave_unique();
    }
    return blocks.size();
}

/// Makes the inputs of a program from particles on the CPU. The program's particles have the order of the slots (the
/// indices of particles in `particles`), but unused slots are left out: particle 0 of the program is the one with the
/// lowest slot.
/// \param dt      time step [s]
/// \param limits  limits of the device on which the program will run
/// \param blocks  for a sparse grid: number of blocks of nodes for which it has memory; 0: blocks_near(particles)
/// \param share   which of the particles the program gets
/// \throws parameter_error  if the domain is periodic but the program is not; if a buffer or an entry point exceeds the
///                          limits (see check_fits()); if a mirrored wall does not fit the grid (see mirrors_of()); or
///                          if a sparse grid has 2^31 blocks or more in the domain
/// \throws particle_error   if a particle is lighter than 2^−86 kg
template <int D, class State>
Inputs make_inputs(const Program& program, const Domain<D>& domain, const Particles<float, D, State>& particles,
                   double dt, const Limits& limits = {}, std::size_t blocks = 0, const Share& share = {}) {
    if (is_periodic(domain) && !program.options.periodic)
        throw parameter_error("The domain is periodic, but the program is not: set ProgramOptions::periodic.");
    firn::detail::require_digits<float>(domain, "A program for a GPU");
    mirrors_of<QuadraticBSpline>(detail::WallsOfProgram{program}, domain);
    Inputs inputs(program);
    const std::vector<std::size_t> slots = detail::slots_of<D>(particles, share);
    const std::size_t count = slots.size();
    std::vector<double> along, cells;
    double lattice_blocks = 1;
    for (int a = 0; a < D; ++a) {
        inputs.nodes.push_back(grid_nodes(domain.cells(a)));
        along.push_back(inputs.nodes.back());
        cells.push_back(double(extent_in_cells<float>(domain, a)));
        lattice_blocks *= along.back() / block_size;
    }
    if (program.options.grid == GridStorage::sparse) {
        if (!(lattice_blocks < 0x1p31))
            throw parameter_error(sentence("The domain has ", lattice_blocks, " blocks of ", block_size, "^", D,
                                           " cells; on a GPU it can have 2147483647. Use larger cells or a smaller "
                                           "domain."));
        if (blocks == 0) blocks = std::max<std::size_t>(1, blocks_near(particles));
        check_fits(program, count, inputs.nodes, limits, blocks);
        inputs.blocks = std::uint32_t(blocks);
        inputs.set("blocks", {double(blocks)});
    } else {
        check_fits(program, count, inputs.nodes, limits);
    }
    inputs.particles = std::uint32_t(count);

    inputs.set("nodes", along);
    inputs.set("particles", {double(count)});
    inputs.set("capacity", {double(count)});
    inputs.set("cells", cells);
    inputs.set("cell_size", {domain.cell_size});
    set_time_step(inputs, dt, domain.cell_size);
    detail::set_corner(inputs, program, domain);
    if (program.options.periodic) detail::set_periods(inputs, domain);
    if (!program.room_lower.empty()) detail::set_room(inputs, program, domain);
    detail::check_heavy_enough(program, particles, slots);

    const FieldTable& table = particles.table();
    for (const Buffer& buffer : program.buffers) {
        if (buffer.per != "particle" || buffer.binding == detail::rates || buffer.binding == detail::loads ||
            buffer.binding == detail::term)
            continue;
        std::vector<float> numbers;
        numbers.reserve(count * std::size_t(buffer.count));
        detail::for_numbers_in(buffer, table, [&](int k, std::size_t field) {
            for (const std::size_t slot : slots)
                numbers.push_back(field < table.size()    ? particles.number(field, slot, k)
                                  : field == table.size() ? float(block_size * particles.block(slot)[std::size_t(k)])
                                                          : 0.0F);
        });
        inputs.buffers.emplace_back(buffer.name, std::move(numbers));
    }

    inputs.buffers.emplace_back("coordinates", detail::node_coordinates(domain, inputs.nodes));
    if (program.distances.size() > 0) inputs.buffers.emplace_back("distances", program.distances.joined());
    return inputs;
}

/// Sets the uniforms of the sinks of a program. A sink is larger there by what rounding to float could hide.
/// \param sinks  boxes with the corners `lower` and `upper` [m], such as firn::Sink
template <int D, class Sinks>
void set_sinks(Inputs& inputs, const Domain<D>& domain, const Sinks& sinks) {
    constexpr double far = 1e30;  // [cells]
    for (std::size_t k = 0; k < sinks.size(); ++k) {
        std::vector<double> lower, upper;
        for (int a = 0; a < D; ++a) {
            const double more = 0.01 + 0x1p-20 * domain.cells(a);
            const auto in_cells = [&](double x) { return (x - domain.lower[a]) / domain.cell_size; };
            lower.push_back(std::clamp(in_cells(sinks[k].lower[a]) - more, -far, far));
            upper.push_back(std::clamp(in_cells(sinks[k].upper[a]) + more, -far, far));
        }
        inputs.set(sentence("sink_", k, "_lower"), lower);
        inputs.set(sentence("sink_", k, "_upper"), upper);
    }
}

/// Sets which loads act on each particle of a program.
/// \param ids   the id of each particle, in the program's order
/// \param acts  acts(k, id) returns whether load k acts on a particle
template <class F>
void set_loads(Inputs& inputs, int loads, const std::vector<std::uint32_t>& ids, const F& acts) {
    std::vector<float> acting(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i)
        for (int k = 0; k < loads; ++k)
            if (acts(std::size_t(k), ids[i])) acting[i] += float(1u << k);
    inputs.buffers.emplace_back("loads", std::move(acting));
}

/// Copies the numbers of a buffer of a program back into particles on the CPU.
/// \param numbers    the contents of the buffer; its capacity is the number of particles
/// \param slots      for each particle of the program, the slot of the particle that gets its numbers
/// \param particles  the particles for which the inputs were made, which may lie in other slots now. Blocks of
///                   positions change, too: make a new partition.
template <int D>
void put_numbers(const Buffer& buffer, const std::vector<float>& numbers, const std::vector<std::size_t>& slots,
                 ParticleStore<float, D>& particles) {
    const FieldTable& table = particles.table();
    const std::size_t count = slots.size();
    const float* from = numbers.data();
    detail::for_numbers_in(buffer, table, [&](int k, std::size_t field) {
        for (std::size_t i = 0; i < count && field < table.size(); ++i)
            particles.set_number(field, slots[i], k, from[i]);
        from += count;
        for (std::size_t i = 0; i < count && field == table.size() && k == D - 1; ++i) {
            BlockCoordinate<D> block{};
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                block[a] = int(from[(a - std::size_t(D)) * count + i]) / block_size;
            particles.set_place(slots[i], block, particles.place(slots[i]));
        }
    });
}

}  // namespace firn::inline FIRN_BUILD::wgsl
