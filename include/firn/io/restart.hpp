/// \file From a state back to a simulation: a run that is restored goes on to the same bits; or, if asked to, a run of
/// another build, precision or policy is gone on from.
#pragma once

#include <firn/io/simulation_state.hpp>

#include <bit>
#include <vector>

namespace firn {

namespace detail {

[[noreturn]] inline void throw_damaged(const std::string& what) {
    throw io_error(sentence("The state's ", what, " is inconsistent; the file is damaged. Go on from another state."));
}

/// The particles of a state as a simulation keeps them.
/// \tparam T  the state's precision
template <class S, int D, class MaterialState, class T>
class ParticlesOfState {
public:
    using Kept = Particles<S, D, MaterialState>;

    /// \throws io_error  where ids do not ascend
    explicit ParticlesOfState(const State<T>& state) : state_(state), n_(state.size()) {
        const double next = parameter_values(state, "run", "next_id")[0];
        if (!(next >= 0 && next <= double(no_particle)) || next != std::floor(next))
            throw io_error(sentence("The state says ", next, " for run/next_id; the file is damaged."));
        next_id_ = std::int64_t(next);
        for (std::size_t i = 0; i < n_; ++i)
            if (state.id[i] < (i == 0 ? 0 : state.id[i - 1] + 1) || state.id[i] >= next_id_)
                throw_damaged("order of particles");
    }

    /// Particles in the order of ids, not in that of blocks.
    /// \throws io_error  where a field is missing or cannot be
    Kept read(const Domain<D>& domain) const {
        const T *x = field("position", D), *v = field("velocity", D), *mass = field("mass", 1),
                *volume = field("volume", 1);
        const T* C = state_.find("affine_velocity") ? field("affine_velocity", D * D) : nullptr;
        Kept particles(domain);
        particles.reserve(n_);
        for (std::size_t i = 0; i < n_; ++i) {
            Vec<double, D> position{};
            std::copy_n(x + i * D, D, position.v);
            if (!(S(mass[i]) > 0) || !(S(volume[i]) >= 0)) throw_damaged("mass or volume");
            particles.skip_ids(std::uint32_t(state_.id[i]));
            particles.push_back(position, vector(v + i * D), S(mass[i]), S(volume[i]), material_state(i));
            if (C) particles.set_affine(i, matrix(C + i * D * D));
        }
        particles.skip_ids(std::uint32_t(next_id_));
        return particles;
    }

    /// The numbers of a field, particle by particle.
    const T* field(const char* name, int components) const {
        const StateField<T>* f = state_.find(name);
        if (!f)
            throw io_error(sentence("The state has no field '", name,
                                    "', without which no run can go on from it: it was written with selected fields, "
                                    "or by another material. Go on from a state with all fields."));
        if (f->components != components || f->values.size() != n_ * std::size_t(components)) throw_damaged(name);
        for (const T value : f->values)
            if (!std::isfinite(S(value)))
                throw io_error(sentence("The state's ", name, " has a value ", value,
                                        ", which is not finite in the simulation's precision. Go on from an earlier "
                                        "state."));
        return f->values.data();
    }
    static Vec<S, D> vector(const T* from) {
        Vec<S, D> r{};
        for (int a = 0; a < D; ++a) r[a] = S(from[a]);
        return r;
    }
    static Mat<S, D> matrix(const T* from) {
        Mat<S, D> m{};
        for (int k = 0; k < D * D; ++k) m(k / D, k % D) = S(from[k]);
        return m;
    }

    std::vector<Body> bodies() const {
        std::vector<Body> all;
        const StateTable& rows = table(state_.tables, "bodies", 3);
        std::int64_t end = 0;  // of the ids of those before
        for (std::size_t row = 0; row < rows.values.size(); row += 3) {
            const std::int64_t first = rows.values[row], count = rows.values[row + 1];
            const double until = std::bit_cast<double>(rows.values[row + 2]);
            if (first < end || count < 0 || first > next_id_ || count > next_id_ - first || std::isnan(until))
                throw_damaged("table of bodies");
            all.push_back({std::uint32_t(first), std::uint32_t(count), until});
            end = first + count;
        }
        return all;
    }

private:
    MaterialState material_state(std::size_t i) const {
        MaterialState state{};
        constexpr auto members = MaterialState::fields();
        unroll<int(std::tuple_size_v<decltype(members)>)>([&](auto f) {
            const auto& m = std::get<f>(members);
            auto& value = state.*(m.member);
            constexpr int components = component_count<std::remove_cvref_t<decltype(value)>>;
            const T* from = fields_of_state(f, m.name, components) + i * std::size_t(components);
            if constexpr (components == D * D)
                value = matrix(from);
            else
                for (int k = 0; k < components; ++k) detail::components(value)[k] = S(from[k]);
        });
        return state;
    }
    /// Looked up once.
    const T* fields_of_state(std::size_t f, const char* name, int components) const {
        if (!found_[f]) found_[f] = field(name, components);
        return found_[f];
    }

    const State<T>& state_;
    std::size_t n_;
    std::int64_t next_id_ = 0;
    mutable std::array<const T*, state_field_count<MaterialState>> found_{};
};

/// The blocks of a state, and which slot each particle had.
/// \throws io_error  where they do not fit each other
template <class Kernel, int D, class T>
BlockPartition<D> partition_of(const State<T>& state) {
    const std::size_t n = state.size();
    const StateTable& slot_of = table(state.tables, "slot", 1);
    const StateTable& blocks = table(state.tables, "blocks", D + 2);
    std::vector<BlockRange<D>> ranges;
    std::size_t placed = 0;
    for (std::size_t row = 0; row < blocks.values.size(); row += D + 2) {
        BlockRange<D> range{};
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            const std::int64_t coordinate = blocks.values[row + a];
            if (coordinate <= -(1 << 20) || coordinate >= (1 << 20)) throw_damaged("table of blocks");
            range.block[a] = int(coordinate);
        }
        if (blocks.values[row + D + 1] < 1 || blocks.values[row + D + 1] > std::int64_t(n))
            throw_damaged("table of blocks");
        range.particles = std::size_t(blocks.values[row + D + 1]);
        if (!ranges.empty() && block_key<D>(range.block) <= block_key<D>(ranges.back().block))
            throw_damaged("table of blocks");
        placed += range.particles;
        ranges.push_back(range);
    }
    if (placed != n || slot_of.values.size() != n) throw_damaged("table of blocks");
    BlockPartition<D> partition = arrange<D>(ranges, colours_along_axis<Kernel>);
    for (std::size_t i = 0; i < ranges.size(); ++i)
        if (std::size_t(blocks.values[i * (D + 2) + D]) != partition.ranges[partition.by_block[i]].first_slot)
            throw_damaged("table of blocks");
    for (std::size_t i = 0; i < n; ++i) {
        const std::int64_t slot = slot_of.values[i];
        if (slot < 0 || slot >= std::int64_t(partition.slots()) || partition.order[std::size_t(slot)] != no_particle)
            throw_damaged("order of particles");
        partition.order[std::size_t(slot)] = std::uint32_t(i);
    }
    for (const BlockRange<D>& range : partition.ranges)
        for (std::size_t i = 0; i < range.particles; ++i)
            if (partition.order[range.first_slot + i] == no_particle) throw_damaged("order of particles");
    return partition;
}

/// Gives particles, in the order of ids, the places and stresses that they had in the run that wrote the state.
/// \param sorted  none has left the reach of its block
template <class Kernel, class S, int D, class MaterialState, class T>
void set_places(Particles<S, D, MaterialState>& particles, const BlockPartition<D>& partition,
                const ParticlesOfState<S, D, MaterialState, T>& read, bool sorted) {
    const std::size_t n = particles.size();
    const T *x = read.field("position", D), *place = read.field("place", D),
            *stress = read.field("kirchhoff_stress", D * D);
    read.field("affine_velocity", D * D);  // 0 will not do
    for (const BlockRange<D>& range : partition.ranges)
        for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) {
            const std::size_t i = partition.order[slot];
            particles.set_place(i, range.block, read.vector(place + i * D));
            particles.set_stress(i, read.matrix(stress + i * D * D));
        }
    if (sorted)
        for (std::size_t k = 0; k < n * D; ++k)
            if (const S node = base_node<Kernel>(S(place[k]));
                node < S(-allowed_drift) || node > S(block_size - 1 + allowed_drift))
                throw_damaged("place of a particle in its block");
    const double fine = 1e-9 * particles.domain().cell_size;
    for (std::size_t i = 0; i < n; ++i)
        for (int a = 0; a < D; ++a) {
            const double there = double(x[i * D + std::size_t(a)]);
            const double rounding = 4 * double(std::numeric_limits<S>::epsilon()) * std::abs(there);
            if (!(std::abs(particles.exact_position(i)[a] - there) <= rounding + fine))
                throw_damaged("place or position of a particle");
        }
}

/// \throws io_error  where the run that wrote the state had another domain, other moduli, …
template <std::size_t I, class Simulation, class T>
void check_same_run(const Simulation& simulation, const State<T>& state, Restart how) {
    check_same(state, policies_of<I>(simulation),
               "Go on with a simulation of the same policies and precision, or ask for Restart::converted.");
    if (how == Restart::same_bits) check_same_build(state);
    const auto& domain = simulation.domain();
    if (parameter_values(state, "grid", "lower") != as_doubles(domain.lower) ||
        parameter_values(state, "grid", "upper") != as_doubles(domain.upper) ||
        parameter_values(state, "grid", "cell_size") != as_doubles(domain.cell_size) ||
        parameter_values(state, "grid", "periodic") !=
            std::vector<double>(domain.periodic.begin(), domain.periodic.end()))
        throw io_error(
            "The state was made in another domain or with other cells than the simulation's. Give the same, or ask for "
            "Restart::converted.");
    for_parameters(simulation.template material<I>(), [&](const std::string& name, const char*, const auto& value) {
        const std::vector<double> theirs = parameter_values(state, "material", name.c_str()), ours = as_doubles(value);
        if (theirs != ours)
            throw io_error(sentence("The state was made with ", name, " = ", theirs[0],
                                    " of the material, this run has ", ours[0],
                                    ". Give the same, or ask for Restart::converted."));
    });
}

}  // namespace detail

/// Goes on from a state. The program makes the simulation as it did for the run that wrote it: the same policies,
/// domain and material, loads, forces between particles, sources and sinks. Particles that it has added are replaced;
/// loads and forces name bodies, so they are added after these, or after the restart. Taken from the state are
/// particles and bodies, time and steps, the boundary with all its parameters (so that what moves is where it was), the
/// transfer's parameters, gravity, fixed_time_step and most_steps_between_sorts; what shall be otherwise is set
/// afterwards. The number of threads is the program's.
///
/// With several materials: once for each, with the states of one moment.
/// With Restart::converted only particles with their ids, velocities and states are taken over, and time and steps; all
/// else (domain, boundary, gravity, …) is the program's. Where the state has no affine_velocity, it is 0.
/// \tparam Named  which of the simulation's materials; of several one must be named
/// \param how  what is asked of the state
/// \throws io_error  naming what differs, is missing or is damaged; the simulation is then as it was
/// \throws particle_error  naming particles outside the domain
template <std::size_t Named = detail::unnamed_material, int D, class Materials, class Transfer, class Force,
          class Kernel, class Execution, class Boundary, state_scalar T>
void restore(Simulation<D, Materials, Transfer, Force, Kernel, Execution, Boundary>& simulation, const State<T>& state,
             Restart how = Restart::same_bits) {
    constexpr std::size_t I =
        detail::named_material<Named, std::remove_cvref_t<decltype(simulation)>::material_count>();
    using S = detail::precision_of_t<Materials>;
    using Material = std::remove_cvref_t<decltype(simulation.template material<I>())>;
    detail::check_dimension(state, D);
    if (how != Restart::converted) detail::check_same_run<I>(simulation, state, how);

    const detail::ParticlesOfState<S, D, material_state_t<Material, D>, T> read(state);
    MaterialSet<D, Material> set{simulation.template material<I>(), read.read(simulation.domain())};
    set.bodies = read.bodies();
    Boundary boundary = simulation.boundary;
    Transfer transfer = simulation.transfer;
    if (how != Restart::converted) {
        set.partition = detail::partition_of<Kernel, D>(state);
        set.report = {detail::parameter_values(state, "run", "signal_speed")[0],
                      detail::parameter_values(state, "run", "sort_needed")[0] != 0};
        detail::set_places<Kernel>(set.particles, set.partition, read, !set.report.sort_needed);
        restore_parameters(boundary, state, "boundary");
        restore_parameters(transfer, state, "transfer");
    }
    if (state.size() > 0)
        check_positions<double, D>(state.size(), simulation.domain(),
                                   [&](std::size_t i, int a) { return set.particles.exact_position(i)[a]; });
    if (how == Restart::converted)
        return simulation.template restore<I>(std::move(set), state.time, state.step, state.last_time_step);

    set.particles.reorder(set.partition, thread_count(requested_threads(simulation.execution)));
    set.prepared = set.checked = true;
    const auto gravity = detail::parameter_values(state, "run", "gravity");
    const double fixed = detail::parameter_values(state, "run", "fixed_time_step")[0],
                 sorts = detail::parameter_values(state, "run", "most_steps_between_sorts")[0];
    if (gravity.size() != D || !(sorts >= 0 && sorts < 0x1p53)) detail::throw_damaged("gravity or sorting");
    simulation.template restore<I>(std::move(set), state.time, state.step, state.last_time_step);
    simulation.boundary = boundary;
    simulation.transfer = transfer;
    std::copy(gravity.begin(), gravity.end(), simulation.gravity.v);
    simulation.fixed_time_step = fixed;
    simulation.most_steps_between_sorts = std::uint64_t(sorts);
}

/// Of the material M: restore<Snow<float>>(simulation, state).
template <class M, int D, class Materials, class... Policies, state_scalar T>
void restore(Simulation<D, Materials, Policies...>& simulation, const State<T>& state,
             Restart how = Restart::same_bits) {
    restore<detail::place_of_material<M, Materials, D>>(simulation, state, how);
}

}  // namespace firn
