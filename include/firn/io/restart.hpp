/// \file Restores a simulation from a state. The run goes on with the same bits or, if asked for, from the state of
/// another build, precision or policy.
#pragma once

#include <firn/io/simulation_state.hpp>

#include <algorithm>
#include <bit>
#include <numeric>
#include <vector>

namespace firn {

namespace detail {

[[noreturn]] inline void throw_damaged(const std::string& what) {
    throw io_error(sentence("The state's ", what, " is inconsistent; the file is damaged. Go on from another state."));
}

/// Reads the particles of a state in the order of their ids. The rows of the state may have another order.
/// \tparam T  the state's precision
template <class S, int D, class T>
class ParticlesOfState {
public:
    /// \throws io_error  if two particles have the same id, or an id is not below `next_id`
    explicit ParticlesOfState(const State<T>& state) : state_(state), n_(state.size()) {
        const double next = parameter_values(state, "run", "next_id")[0];
        if (!(next >= 0 && next <= double(no_particle)) || next != std::floor(next))
            throw io_error(sentence("The state has ", next, " for run/next_id; the file is damaged."));
        next_id_ = std::int64_t(next);
        if (!std::ranges::is_sorted(state.id)) {
            rows_.resize(n_);
            std::iota(rows_.begin(), rows_.end(), std::size_t(0));
            std::ranges::sort(rows_, {}, [&](std::size_t row) { return state.id[row]; });
        }
        for (std::size_t i = 0; i < n_; ++i)
            if (id(i) < (i == 0 ? 0 : id(i - 1) + 1) || id(i) >= next_id_) throw_damaged("order of particles");
    }

    /// The row of the particle with the i-th lowest id.
    std::size_t row(std::size_t i) const { return rows_.empty() ? i : rows_[i]; }
    std::int64_t id(std::size_t i) const { return state_.id[row(i)]; }

    /// Appends the particles.
    /// \param converted  whether to ignore stresses, which follow from the other fields, and to set a missing affine
    ///                   field to 0
    /// \throws io_error  if a field is missing or invalid
    void read(ParticleStore<S, D>& particles, bool converted) const {
        const T* const x = field("position", D);
        particles.reserve(n_);
        for (std::size_t i = 0; i < n_; ++i) {
            Vec<double, D> position{};
            std::copy_n(x + row(i) * D, D, position.v);
            particles.skip_ids(std::uint32_t(id(i)));
            particles.push_back(position);
        }
        particles.skip_ids(std::uint32_t(next_id_));
        for (std::size_t f = 0; f < particles.table().size(); ++f) {
            const FieldInfo& info = particles.table()[f];
            const bool may_lack = info.role == FieldRole::constant || (info.role == FieldRole::affine && converted);
            if (f == particles.place_field || (info.role == FieldRole::stress && converted) ||
                (may_lack && !state_.find(info.name)))
                continue;
            set(particles, f);
        }
    }
    /// Sets a field of the particles, which are in the order of their ids.
    void set(ParticleStore<S, D>& particles, std::size_t f) const {
        const FieldInfo& info = particles.table()[f];
        const int components = info.components_in_state(D);
        const T* const from = field(info.name, components);
        std::array<S, 9> numbers{};
        for (std::size_t i = 0; i < n_; ++i) {
            for (int k = 0; k < components; ++k) {
                numbers[std::size_t(k)] = S(from[row(i) * std::size_t(components) + std::size_t(k)]);
                if (!info.allows(double(numbers[std::size_t(k)]))) throw_damaged(info.name);
            }
            particles.set(f, i, numbers.data());
        }
    }

    /// Returns the numbers of a field, row by row.
    /// \throws io_error  if the field is missing or invalid
    const T* field(const char* name, int components) const {
        const StateField<T>* f = state_.find(name);
        if (!f)
            throw io_error(sentence("The state has no field '", name,
                                    "', which a run needs to go on: it was written with selected fields, or by "
                                    "another material. Go on from a state with all fields."));
        if (f->components != components || f->values.size() != n_ * std::size_t(components)) throw_damaged(name);
        for (const T value : f->values)
            if (!std::isfinite(S(value)))
                throw io_error(sentence("The state's ", name, " has a value ", value,
                                        ", which is not finite in the simulation's precision. Go on from an earlier "
                                        "state."));
        return f->values.data();
    }

    std::vector<Body> bodies() const {
        std::vector<Body> all;
        const StateTable& rows = table(state_.tables, "bodies", 3);
        std::int64_t end = 0;  // of the ids of the bodies before
        for (std::size_t at = 0; at < rows.values.size(); at += 3) {
            const std::int64_t first = rows.values[at], count = rows.values[at + 1];
            const double until = std::bit_cast<double>(rows.values[at + 2]);
            if (first < end || count < 0 || first > next_id_ || count > next_id_ - first || std::isnan(until))
                throw_damaged("table of bodies");
            all.push_back({std::uint32_t(first), std::uint32_t(count), until});
            end = first + count;
        }
        return all;
    }

    /// Returns the blocks of the state and the slot of each particle.
    /// \param colours  number of colours of dense blocks along an axis
    /// \throws io_error  if blocks and slots do not fit each other
    BlockPartition<D> partition(int colours) const {
        const StateTable& slot_of = table(state_.tables, "slot", 1);
        const StateTable& blocks = table(state_.tables, "blocks", D + 2);
        std::vector<BlockRange<D>> ranges;
        std::size_t placed = 0;
        for (std::size_t at = 0; at < blocks.values.size(); at += D + 2) {
            BlockRange<D> range{};
            for (std::size_t a = 0; a < std::size_t(D); ++a) {
                const std::int64_t coordinate = blocks.values[at + a];
                if (coordinate <= -(1 << 20) || coordinate >= (1 << 20)) throw_damaged("table of blocks");
                range.block[a] = int(coordinate);
            }
            if (blocks.values[at + D + 1] < 1 || blocks.values[at + D + 1] > std::int64_t(n_))
                throw_damaged("table of blocks");
            range.particles = std::size_t(blocks.values[at + D + 1]);
            if (!ranges.empty() && block_key<D>(range.block) <= block_key<D>(ranges.back().block))
                throw_damaged("table of blocks");
            placed += range.particles;
            ranges.push_back(range);
        }
        if (placed != n_ || slot_of.values.size() != n_) throw_damaged("table of blocks");
        BlockPartition<D> partition = arrange<D>(ranges, colours);
        for (std::size_t i = 0; i < ranges.size(); ++i)
            if (std::size_t(blocks.values[i * (D + 2) + D]) != partition.ranges[partition.by_block[i]].first_slot)
                throw_damaged("table of blocks");
        for (std::size_t i = 0; i < n_; ++i) {
            const std::int64_t slot = slot_of.values[row(i)];
            if (slot < 0 || slot >= std::int64_t(partition.slots()) ||
                partition.order[std::size_t(slot)] != no_particle)
                throw_damaged("order of particles");
            partition.order[std::size_t(slot)] = std::uint32_t(i);
        }
        for (const BlockRange<D>& range : partition.ranges)
            for (std::size_t i = 0; i < range.particles; ++i)
                if (partition.order[range.first_slot + i] == no_particle) throw_damaged("order of particles");
        return partition;
    }

    /// Sets the places of the particles, which are in the order of ids, to those in the run that wrote the state.
    /// \param base_shift  the kernel's
    /// \param sorted      whether every particle must be within reach of its block
    /// \throws io_error  if places are invalid or do not fit the positions
    void set_places(ParticleStore<S, D>& particles, const BlockPartition<D>& partition, double base_shift,
                    bool sorted) const {
        const T *x = field("position", D), *places = field("place", D);
        for (const BlockRange<D>& range : partition.ranges)
            for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) {
                const std::size_t i = partition.order[slot];
                Vec<S, D> place{};
                for (int a = 0; a < D; ++a) place[a] = S(places[row(i) * D + std::size_t(a)]);
                particles.set_place(i, range.block, place);
            }
        if (sorted)
            for (std::size_t k = 0; k < n_ * D; ++k)
                if (const S node = base_node(S(places[k]), S(base_shift));
                    node < S(-allowed_drift) || node > S(block_size - 1 + allowed_drift))
                    throw_damaged("place of a particle in its block");
        const double fine = 1e-9 * particles.domain().cell_size;
        for (std::size_t i = 0; i < n_; ++i)
            for (int a = 0; a < D; ++a) {
                const double there = double(x[row(i) * D + std::size_t(a)]);
                const double rounding = 4 * double(std::numeric_limits<S>::epsilon()) * std::abs(there);
                if (!(std::abs(particles.exact_position(i)[a] - there) <= rounding + fine))
                    throw_damaged("place or position of a particle");
            }
    }

private:
    const State<T>& state_;
    std::size_t n_;
    std::int64_t next_id_ = 0;
    std::vector<std::size_t> rows_;  // in the order of ids; empty if the rows are in this order
};

/// \throws io_error  if the run that wrote the state had another domain, material parameter, …
template <std::size_t I, class Simulation, class T>
void check_same_run(const Simulation& simulation, const State<T>& state, Restart how) {
    check_same(state, policies_of<I>(simulation),
               "Go on with a simulation of the same policies and precision, or use Restart::converted.");
    if (how == Restart::same_bits) check_same_build(state);
    const auto& domain = simulation.domain();
    if (parameter_values(state, "grid", "lower") != as_doubles(domain.lower) ||
        parameter_values(state, "grid", "upper") != as_doubles(domain.upper) ||
        parameter_values(state, "grid", "cell_size") != as_doubles(domain.cell_size) ||
        parameter_values(state, "grid", "periodic") !=
            std::vector<double>(domain.periodic.begin(), domain.periodic.end()))
        throw io_error(
            "The state has another domain or other cells than the simulation. Give the same, or use "
            "Restart::converted.");
    for_parameters(simulation.template set<I>().material(), [&](const std::string& name, const char*,
                                                                const auto& value) {
        const std::vector<double> theirs = parameter_values(state, "material", name.c_str()), ours = as_doubles(value);
        if (theirs != ours)
            throw io_error(sentence("The material of the state has ", name, " = ", theirs[0], ", that of this run has ",
                                    ours[0], ". Give the same, or use Restart::converted."));
    });
}

}  // namespace detail

/// Restores a set of particles from a state, so that the run goes on.
///
/// First make the simulation as for the run that wrote the state: with the same policies, domain, material, loads,
/// forces between particles, sources and sinks. Loads and forces name bodies, so add them after the particles, or after
/// the restart. The particles of the state replace those in the simulation.
///
/// From the state come particles and bodies, time and steps, all parameters of the boundary (a moving one returns to
/// its place) and of the transfer, gravity, fixed_time_step and most_steps_between_sorts. Set them afterwards to change
/// them. The number of threads is the simulation's.
///
/// With several materials, call it once for each material, with states of the same time.
///
/// With Restart::converted, only particles with their ids, velocities and material states, and time and steps come from
/// the state. Everything else (domain, boundary, gravity, …) is the simulation's. If the state has no affine_velocity,
/// it is 0.
/// \param set    such as `simulation.set<Snow<float>>()` in a simulation with several materials
/// \param state  such as read_state() returns
/// \param how    which states are accepted
/// \throws io_error        if something differs, is missing or is damaged, which the message names; the simulation then
///                         does not change
/// \throws particle_error  if particles are outside the domain
template <class Simulation, std::size_t I, state_scalar T>
void restore(SetHandle<Simulation, I> set, const State<T>& state, Restart how = Restart::same_bits) {
    constexpr int D = Simulation::dimension;
    using S = typename Simulation::scalar_type;
    using Kernel = typename Simulation::kernel_type;
    Simulation& simulation = set.simulation();
    detail::check_dimension(state, D);
    if (how != Restart::converted) detail::check_same_run<I>(simulation, state, how);

    const detail::ParticlesOfState<S, D, T> read(state);
    std::tuple_element_t<I, typename Simulation::Sets> stored{
        set.material(), std::remove_cvref_t<decltype(set.particles())>(simulation.domain())};
    read.read(stored.particles, how == Restart::converted);
    stored.bodies = read.bodies();
    auto boundary = simulation.boundary;
    auto transfer = simulation.transfer;
    if (how != Restart::converted) {
        stored.partition = read.partition(colours_along_axis<Kernel>);
        stored.report = {detail::parameter_values(state, "run", "signal_speed")[0],
                         detail::parameter_values(state, "run", "sort_needed")[0] != 0};
        read.set_places(stored.particles, stored.partition, Kernel::base_shift, !stored.report.sort_needed);
        restore_parameters(boundary, state, "boundary");
        restore_parameters(transfer, state, "transfer");
    }
    if (state.size() > 0)
        check_positions<double, D>(state.size(), simulation.domain(),
                                   [&](std::size_t i, int a) { return stored.particles.exact_position(i)[a]; });
    const Moment moment{state.time, state.step, state.last_time_step};
    stored.readiness.restore(how != Restart::converted);
    if (how == Restart::converted) return simulation.template restore<I>(std::move(stored), moment);

    stored.particles.reorder(stored.partition, thread_count(requested_threads(simulation.execution)));
    const auto gravity = detail::parameter_values(state, "run", "gravity");
    const double fixed = detail::parameter_values(state, "run", "fixed_time_step")[0],
                 sorts = detail::parameter_values(state, "run", "most_steps_between_sorts")[0];
    if (gravity.size() != D || !(sorts >= 0 && sorts < 0x1p53)) detail::throw_damaged("gravity or sorting");
    simulation.template restore<I>(std::move(stored), moment);
    simulation.boundary = boundary;
    simulation.transfer = transfer;
    std::copy(gravity.begin(), gravity.end(), simulation.gravity.v);
    simulation.fixed_time_step = fixed;
    simulation.most_steps_between_sorts = std::uint64_t(sorts);
}
/// Restores a simulation with one material from a state, as above.
template <int D, class Material, class... Policies, state_scalar T>
void restore(Simulation<D, Material, Policies...>& simulation, const State<T>& state,
             Restart how = Restart::same_bits) {
    restore(simulation.set(), state, how);
}

}  // namespace firn
