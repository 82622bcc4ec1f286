/// \file A set of particles on a device, in as many buffers as it needs.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/simulation/bound.hpp>
#include <firn/simulation/load.hpp>
#include <firn/sort/partition.hpp>
#include <firn/webgpu/host.hpp>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::webgpu::detail {

/// Returns the partition of particles by the blocks from which their places are counted now. No place is counted anew,
/// as sort_particles() does.
template <std::floating_point S, int D>
BlockPartition<D> partition_as_counted(const KernelFacts& kernel, ParticleStore<S, D>& particles, int threads) {
    const PlacesOfParticles<S> places = particles.places();
    BlockSort<D> sort(places.slots, places.id, threads, particles.room());
    sort.look([&](std::size_t i) { return places.is_particle(i); },
              [&](std::size_t first, std::size_t count, BlockCells& cells) {
                  const S in_first_cell[D][pack_size] = {};
                  for (std::size_t l = 0; l < pack_size; ++l)
                      cells.origin[l] = l < count && places.is_particle(first + l) ? places.block_key(first + l) : 0;
                  find_cells<S, D>(in_first_cell, cells);
              });
    return sort.partition(kernel.colours);
}

/// Particles of a set that fit into one buffer of the device.
struct Chunk {
    std::unique_ptr<Host> host{};
    std::vector<std::uint32_t> ids{};  // of the particles, in their order on the device
};

/// Returns the loads of a set.
template <int D>
std::span<const Load<D>> list_of_loads(const firn::detail::MaybePush<float, D>& held) {
    if (const auto* const loads = firn::detail::loads_of(held)) return loads->all();
    return {};
}

/// Returns the forces of the loads of all sets at a time [s], on each particle of their bodies [N]. \see UniformForce
template <int D>
std::vector<Vec<double, D>> forces_of_loads(const SetList<float, D>& sets, double time) {
    std::vector<Vec<double, D>> all;
    for (const auto& set : sets)
        for (const Load<D>& load : list_of_loads(set.loads)) all.push_back(load.force(Vec<double, D>::zero(), time));
    return all;
}

/// Returns the time of the next burst of a source or end of a body [s]; infinite if there is none.
template <int D>
double next_event(const SetList<float, D>& sets) {
    double next = firn::detail::next_burst(sets);
    for (const auto& set : sets)
        for (const Body& body : set.bodies)
            if (body.count > 0) next = std::min(next, body.end);
    return next;
}

/// A set of particles on a device: its program, and its particles in chunks.
template <int D>
struct SetOnDevice {
    wgsl::Program program;
    std::vector<Chunk> chunks{};

    /// Takes a set to the device, for the program. Buffers that have the right size are used again.
    /// \param here          the domain as the program has it. \see domain_from_corner
    /// \param blocks        for a sparse grid: number of blocks of nodes for which it has memory
    /// \param set_uniforms  sets uniforms of inputs, besides those of particles, grid and sinks
    /// \param grid          the Host that has the buffers of the grid; nullptr: the first one of this set
    template <class Set, class F>
    void take(const Device& device, const Domain<D>& domain, const Domain<D>& here, const Set& set, double dt,
              std::size_t blocks, const F& set_uniforms, const Host* grid) {
        const std::size_t all = set.particles.size(), most = wgsl::most_particles(program, device.limits());
        const std::size_t count = std::max<std::size_t>(1, (all + most - 1) / most), each = (all + count - 1) / count;
        chunks.resize(count);
        const std::span<const Load<D>> loads = list_of_loads(set.loads);
        for (std::size_t c = 0; c < count; ++c) {
            const wgsl::Share share{c * each, each};
            wgsl::Inputs inputs =
                wgsl::make_inputs<D>(program, here, set.particles, dt, device.limits(), blocks, share);
            inputs.set("first_particle", {double(share.first)});
            wgsl::set_sinks(inputs, domain, set.sinks);
            wgsl::detail::set_corner(inputs, program, domain);  // of which the material is told
            set_uniforms(inputs);
            Chunk& chunk = chunks[c];
            chunk.ids.clear();
            for (const std::size_t slot : wgsl::detail::slots_of<D>(set.particles, share))
                chunk.ids.push_back(set.particles.id(slot));
            if (!loads.empty())
                wgsl::set_loads(inputs, int(loads.size()), chunk.ids,
                                [&](std::size_t k, std::uint32_t id) { return loads[k].body.holds(id); });
            const Host* const of_grid = grid || c == 0 ? grid : chunks[0].host.get();
            if (of_grid)  // which has them
                std::erase_if(inputs.buffers, [](const auto& buffer) { return buffer.first == "distances"; });
            if (chunk.host && chunk.host->is_for(program, inputs, of_grid)) {
                chunk.host->take(inputs);
                continue;
            }
            chunk.host.reset();  // before its successor needs memory
            chunk.host = std::make_unique<Host>(device, program, inputs, of_grid);
        }
    }

    /// Gives the forces of the loads of this set to the device. Moves `next` on, to the force of the next set.
    template <class Forces>
    void set_forces(Forces& next) const {
        for (int k = 0; k < program.options.loads; ++k, ++next)
            for (const Chunk& chunk : chunks) chunk.host->set(sentence("load_", k), {next->v, next->v + D});
    }

    /// Returns the chunk that has particle i of the set. Makes i the index in this chunk.
    const Chunk& chunk_of(std::size_t& i) const {
        std::size_t c = 0;
        for (; i >= chunks.at(c).ids.size(); ++c) i -= chunks[c].ids.size();
        return chunks[c];
    }

    /// Copies what steps change of a set's particles back to the CPU, in the order in which their places are counted.
    template <class Set>
    void bring_back(Set& set, const KernelFacts& kernel, int threads) const {
        ParticleStore<float, D>& particles = set.store();
        for_chunks(particles, [&](const Chunk& chunk, const std::vector<std::size_t>& slots) {
            for (const char* name : {"motion", "affine", "stress", "state"})
                for (const wgsl::Buffer& buffer : program.buffers)
                    if (buffer.name == name)
                        wgsl::put_numbers<D>(buffer, chunk.host->template read_buffer<float>(name), slots, particles);
        });
        set.partition = partition_as_counted(kernel, particles, threads);
        particles.reorder(set.partition, threads);
        set.forget_pushes();
    }
    /// Gives a set the places of its particles before the last step, for its sinks.
    template <class Set>
    void read_places_before(Set& set) const {
        if (program.options.sinks == 0) return;
        set.places_before.assign(set.store().used_slots(), {});
        for_chunks(set.store(), [&](const Chunk& chunk, const std::vector<std::size_t>& slots) {
            const std::vector<float> places = chunk.host->template read<float>(wgsl::detail::place_before);
            for (std::size_t i = 0; i < slots.size(); ++i)
                std::copy_n(&places[i * std::size_t(D)], D, set.places_before[slots[i]].v);
        });
    }

private:
    /// Calls f(chunk, slots) for each chunk, with the slots on the CPU of its particles.
    template <class F>
    void for_chunks(const ParticleStore<float, D>& particles, const F& f) const {
        std::vector<std::size_t> slot_of(particles.next_id()), slots;
        for (const std::size_t slot : wgsl::detail::slots_of<D>(particles)) slot_of[particles.id(slot)] = slot;
        for (const Chunk& chunk : chunks) {
            slots.clear();
            for (const std::uint32_t id : chunk.ids) slots.push_back(slot_of[id]);
            f(chunk, slots);
        }
    }
};

/// Gives the forces of all loads to the device, as forces_of_loads() returns them.
template <int D>
void set_forces(const std::vector<SetOnDevice<D>>& sets, const std::vector<Vec<double, D>>& forces) {
    auto next = forces.begin();
    for (const SetOnDevice<D>& set : sets) set.set_forces(next);
}

/// Returns the entry points of a step of several sets of particles on one grid, in their order.
/// \param sums_by_block  whether P2G sums up in workgroup memory. \see wgsl::entry_points_of
template <int D>
Host::Sequence step_of_sets(const std::vector<SetOnDevice<D>>& sets, bool sums_by_block) {
    Host::Sequence step;
    const auto add = [&](const std::string& pass, std::size_t first, std::size_t last) {
        const wgsl::Program& program = sets[first].program;
        for (const std::string& name : wgsl::entry_points_of(program, pass, sums_by_block))
            if (!wgsl::has_own_buffers(program, name))
                step.emplace_back(sets[0].chunks[0].host.get(), name);
            else
                for (std::size_t k = first; k < last; ++k)
                    for (const Chunk& chunk : sets[k].chunks) step.emplace_back(chunk.host.get(), name);
    };
    std::vector<std::string> by_set;
    const auto add_by_set = [&] {
        for (std::size_t k = 0; k < sets.size(); ++k)
            for (const std::string& pass : by_set) add(pass, k, k + 1);
        by_set.clear();
    };
    for (const std::string& pass : wgsl::passes_of_programs) {
        if (wgsl::runs_by_set(sets[0].program, pass)) {
            by_set.push_back(pass);
            continue;
        }
        add_by_set();
        add(pass, 0, sets.size());
    }
    add_by_set();
    return step;
}

}  // namespace firn::inline FIRN_BUILD::webgpu::detail
