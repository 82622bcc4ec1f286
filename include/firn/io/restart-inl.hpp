/// \file Bodies of restart.hpp. A program that links firn::compiled_hdf5 does not include them.
#pragma once

#include <firn/io/restart.hpp>

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Reads the particles of a state, in the order of the particles' ids. Particle i is the particle with the i-th lowest
/// id, from 0. In the state, the particles may have another order.
/// \tparam S  the simulation's precision
/// \tparam T  the state's precision
template <class S, int D, class T>
class ParticlesOfState {
public:
    /// Reads and checks the ids. The state must exist as long as this object.
    /// \throws io_error  if two particles have the same id, if the state has no valid parameter `next_id`, or if an id
    ///                   is negative or not below `next_id`
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

    /// Returns the index of particle i in the arrays of the state.
    std::size_t row(std::size_t i) const { return rows_.empty() ? i : rows_[i]; }
    /// Returns the id of particle i.
    std::int64_t id(std::size_t i) const { return state_.id[row(i)]; }

    /// Appends the particles of the state to `particles`, in the order of their ids, and sets their fields.
    /// \param converted  whether the particles are restored with Restart::converted. If so, stresses are not read,
    ///                   because they are computed from the other fields; and if the state has no affine velocities,
    ///                   the affine velocities of the particles are 0.
    /// \throws io_error  if the state lacks a field, or if a value in the state is invalid
    void read(ParticleStore<S, D>& particles, bool converted) const {
        const T* const x = field("position", D);
        particles.reserve(n_);
        for (std::size_t i = 0; i < n_; ++i) {
            Vec<double, D> position{};
            for (int a = 0; a < D; ++a)  // a position on a face, rounded to T, may lie outside
                position[a] = snapped_to_faces<T>(particles.domain(), a, double(x[row(i) * D + std::size_t(a)]));
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
    /// Sets one field of all particles to the field's values in the state. If the state lacks the field's remainders,
    /// it is of schema_version 4 or earlier, and they are 0.
    /// \param particles  the particles in the order of their ids
    /// \param f          index of the field in the particles' table
    /// \throws io_error  if the state lacks the field, or if a value of the field is invalid
    void set(ParticleStore<S, D>& particles, std::size_t f) const {
        const FieldInfo& info = particles.table()[f];
        const auto components = std::size_t(info.components_in_state(D));
        const auto less_one = std::size_t(info.components_less_one(D));
        const T* const from = field(info.name, int(components));
        const std::string of_remainders = info.remainder_name();
        const T* remainders = nullptr;
        if (less_one > 0 && state_.find(of_remainders)) remainders = field(of_remainders.c_str(), int(less_one));
        const T* const end = remainders + (remainders ? n_ * less_one : 0);
        for (const T* r = remainders; r != end; ++r)  // they are smaller than the last digit of what they belong to
            if (!(std::abs(*r) <= T(1e-3))) throw_damaged(of_remainders);
        for (std::size_t i = 0; i < n_; ++i) {
            const T* const numbers = from + row(i) * components;
            for (std::size_t k = 0; k < components; ++k)
                if (!info.allows(double(S(numbers[k])))) throw_damaged(info.name);
            particles.set(f, i, numbers, remainders ? remainders + row(i) * less_one : nullptr);
        }
    }

    /// Returns a pointer to the values of a field in the state: all components of the state's first particle, then
    /// those of the second, and so on.
    /// \throws io_error  if the state lacks the field, if the field does not have `components` components, or if a
    ///                   value is not finite
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

    /// Returns the bodies of the state.
    /// \throws io_error  if the table of bodies is missing or invalid
    std::vector<Body> bodies() const {
        std::vector<Body> all;
        const StateTable& rows = table(state_.tables, "bodies", 3);
        std::int64_t end = 0;  // the last id of the previous body, plus 1
        for (std::size_t at = 0; at < rows.values.size(); at += 3) {
            const std::int64_t first = rows.values[at], count = rows.values[at + 1];
            const double until = std::bit_cast<double>(rows.values[at + 2]);
            if (first < end || count < 0 || first > next_id_ || count > next_id_ - first || std::isnan(until))
                throw_damaged("table of bodies");
            all.push_back({std::uint32_t(first), std::uint32_t(count), until});
            end = first + count;
        }
        for (const StateTable& groups : state_.tables) {
            if (groups.name != "contact_group") continue;
            if (groups.columns != 1 || groups.values.size() != all.size()) throw_damaged("table of contact groups");
            for (std::size_t b = 0; b < all.size(); ++b) {
                const std::int64_t group = groups.values[b];
                if (group < 0 || group >= std::numeric_limits<int>::max()) throw_damaged("table of contact groups");
                all[b].contact_group = int(group);
            }
        }
        return all;
    }

    /// Returns the partition that the particles had in the run that wrote the state: the blocks of the particles, and
    /// the particle in each slot. In BlockPartition::order, the value i stands for particle i, the particle with the
    /// i-th lowest id.
    ///
    /// The table `blocks` says which slots belong to which block. A particle belongs to the block that has its slot,
    /// and the particles of a block are in the order of their slots. Which slots a block has, and the order of the
    /// blocks, are free: state_of() counts the particles along a curve, and earlier versions took the slots of memory.
    /// \param colours  number of colours of dense blocks along an axis (colours_along_axis of the kernel)
    /// \throws io_error  if the table of blocks or the table of slots is missing, or if these tables contradict each
    ///                   other
    BlockPartition<D> partition(int colours) const {
        const StateTable& slot_of = table(state_.tables, "slot", 1);
        const StateTable& blocks = table(state_.tables, "blocks", D + 2);
        std::vector<BlockRange<D>> ranges;  // first_slot: the first slot in the state
        std::size_t placed = 0;
        std::int64_t end = 0;  // one past the highest slot in the state
        // Groups of blocks were padded to whole packs, so a block has at most one pack of padding.
        const std::int64_t most = std::int64_t(n_ + blocks.values.size() / (D + 2) * pack_size);
        for (std::size_t at = 0; at < blocks.values.size(); at += D + 2) {
            BlockRange<D> range{};
            for (std::size_t a = 0; a < std::size_t(D); ++a) {
                const std::int64_t coordinate = blocks.values[at + a];
                if (coordinate <= -(1 << 20) || coordinate >= (1 << 20)) throw_damaged("table of blocks");
                range.block[a] = int(coordinate);
            }
            const std::int64_t first = blocks.values[at + D], count = blocks.values[at + D + 1];
            if (count < 1 || count > std::int64_t(n_) || first < 0 || first > most - count)
                throw_damaged("table of blocks");
            range.first_slot = std::size_t(first);
            range.particles = std::size_t(count);
            end = std::max(end, first + count);
            placed += range.particles;
            ranges.push_back(range);
        }
        if (placed != n_ || slot_of.values.size() != n_) throw_damaged("table of blocks");
        std::ranges::sort(ranges, {}, [](const BlockRange<D>& range) { return block_key<D>(range.block); });
        for (std::size_t i = 1; i < ranges.size(); ++i)
            if (ranges[i].block == ranges[i - 1].block) throw_damaged("table of blocks");

        aligned_vector<std::uint32_t> in_slot(std::size_t(end), no_particle);  // the particle in each slot of the state
        for (std::size_t i = 0; i < n_; ++i) {
            const std::int64_t slot = slot_of.values[row(i)];
            if (slot < 0 || slot >= end || in_slot[std::size_t(slot)] != no_particle)
                throw_damaged("order of particles");
            in_slot[std::size_t(slot)] = std::uint32_t(i);
        }
        BlockPartition<D> partition = arrange<D>(ranges, colours);
        for (std::size_t b = 0; b < ranges.size(); ++b) {
            const std::size_t to = partition.ranges[partition.by_block[b]].first_slot;
            for (std::size_t k = 0; k < ranges[b].particles; ++k) {
                // Each particle is taken once, so that blocks cannot share slots.
                const std::uint32_t i = std::exchange(in_slot[ranges[b].first_slot + k], no_particle);
                if (i == no_particle) throw_damaged("order of particles");
                partition.order[to + k] = i;
            }
        }
        return partition;
    }

    /// Sets the field `place` of each particle, the particle's position within its block [cells], to the value in the
    /// state.
    /// \param particles   the particles in the order of their ids
    /// \param partition   the result of partition()
    /// \param base_shift  base_shift of the kernel: a particle at x has the base node floor(x − base_shift) [cells]
    /// \param sorted      whether the particles need no sort before the next step; if so, the base node of each
    ///                    particle must be at most allowed_drift cells outside the particle's block
    /// \throws io_error  if a value of `place` is invalid, or if it contradicts the field `position`
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
    std::vector<std::size_t> rows_;  // row(i) of each particle i; empty if the state is in the order of ids
};

template <std::floating_point S, int D, class T>
[[gnu::cold]] void check_same_run(const PolicyFacts& facts, const Domain<D>& domain, const SetOf<S, D>& set,
                                  const State<T>& state, Restart how) {
    constexpr const char* advice =
        "Go on with a simulation of the same policies and precision, or use Restart::converted.";
    const std::vector<StateAttribute>& policies = facts.attributes;
    check_same(state, policies, advice);
    // A state says nothing of a volumetric policy or a contact law that is the default.
    for (const StateAttribute& unsaid : {StateAttribute{"volumetric", std::string(OwnVolume::name)},
                                         StateAttribute{"contact", std::string(OneField::name)}}) {
        const auto is_it = [&](const StateAttribute& a) { return a.name == unsaid.name; };
        if (std::any_of(state.attributes.begin(), state.attributes.end(), is_it) &&
            std::none_of(policies.begin(), policies.end(), is_it))
            check_same(state, {unsaid}, advice);
    }
    if (how == Restart::same_bits) {
        check_same_build(state);
        constexpr const char* same =
            "Make the simulation as for the run that wrote the state; change it after restore(). Restart::other_build "
            "compares nine digits, and no data.";
        check_settings(state, facts.settings.attribute(settings_name), same);
        if (!set.sources.empty() || !set.sinks.empty())  // they may follow
            check_settings(state, settings_of(set.sources, set.sinks).attribute(sources_name), same);
    }
    const auto check_value = [&](const char* group, const char* what, const std::string& name,
                                 const std::vector<double>& ours) {
        const std::vector<double> theirs = parameter_values(state, group, name.c_str());
        if (theirs != ours)
            throw io_error(sentence("The ", what, " of the state has ", name, " = ", numbers_text(theirs),
                                    ", that of this run has ", numbers_text(ours),
                                    ". Give the same, or use Restart::converted."));
    };
    check_value("grid", "domain", "lower", as_doubles(domain.lower));
    check_value("grid", "domain", "upper", as_doubles(domain.upper));
    check_value("grid", "domain", "cell_size", as_doubles(domain.cell_size));
    check_value("grid", "domain", "periodic", std::vector<double>(domain.periodic.begin(), domain.periodic.end()));
    for (const StateParameter& ours : facts.parameters)
        if (ours.group == "material") check_value("material", "material", ours.name, ours.values);
}

/// Checks the contact groups of bodies, and puts the particles of a converted state into them. (The particles of other
/// states lie in the blocks of their groups already.)
/// \throws io_error  if the domain has no blocks for a group
template <std::floating_point S, int D>
[[gnu::cold]] void restore_contact_groups(SetOf<S, D>& stored, bool converted) {
    const Domain<D>& domain = stored.store().domain();
    for (const Body& body : stored.bodies) {
        if (body.contact_group == 0) continue;
        if (body.contact_group >= most_contact_groups(domain))
            throw io_error(sentence("The state has a body of contact group ", body.contact_group,
                                    "; in this domain there are groups 0 to ", most_contact_groups(domain) - 1, "."));
        if (converted) stored.move_to_group(body, body.contact_group);
    }
}
/// Checks that the particles lie in the blocks of their bodies' contact groups, and tells the partition of them.
/// \throws io_error  if a particle does not
template <std::floating_point S, int D>
[[gnu::cold]] void check_contact_groups(SetOf<S, D>& stored) {
    const ParticleStore<S, D>& particles = stored.store();
    bool grouped = particles.has_contact_groups();
    for (const Body& body : stored.bodies) grouped = grouped || body.contact_group != 0;
    if (!grouped) return;
    for (std::size_t slot = 0; slot < particles.slots(); ++slot) {
        if (!particles.is_particle(slot)) continue;
        const std::size_t b = stored.body_of(particles.id(slot));
        const int group = b < stored.bodies.size() ? stored.bodies[b].contact_group : 0;
        if (particles.contact_group(slot) != group) throw_damaged("table of contact groups");
    }
    stored.partition.copy_stride = copy_stride(particles.domain());
}

template <std::floating_point S, int D, class T>
[[gnu::cold]] RestoredRun read_particles(const State<T>& state, Restart how, const KernelFacts& kernel, int threads,
                                         SetOf<S, D>& stored) {
    const ParticlesOfState<S, D, T> read(state);
    RestoredRun made{{state.time, state.step, state.last_time_step}, how == Restart::converted};
    ParticleStore<S, D>& particles = stored.store();
    read.read(particles, made.converted);
    stored.bodies = read.bodies();
    restore_contact_groups(stored, made.converted);
    if (!made.converted) {
        stored.partition = read.partition(kernel.colours);
        stored.report = {parameter_values(state, "run", "signal_speed")[0],
                         parameter_values(state, "run", "sort_needed")[0] != 0};
        read.set_places(particles, stored.partition, kernel.base_shift, !stored.report.sort_needed);
        check_contact_groups(stored);
    }
    if (state.size() > 0)
        check_positions<double, D, S>(state.size(), particles.domain(),
                                      [&](std::size_t i, int a) { return particles.exact_position(i)[a]; });
    stored.readiness.restore(!made.converted);
    if (made.converted) return made;

    particles.reorder(stored.partition, threads);
    made.gravity = parameter_values(state, "run", "gravity");
    made.fixed_time_step = parameter_values(state, "run", "fixed_time_step")[0];
    made.most_steps_between_sorts = parameter_values(state, "run", "most_steps_between_sorts")[0];
    if (made.gravity.size() != D || !(made.most_steps_between_sorts >= 0 && made.most_steps_between_sorts < 0x1p53))
        throw_damaged("gravity or sorting");
    if (has_parameter(state, "run", "largest_acceleration")) {
        made.largest_acceleration = parameter_values(state, "run", "largest_acceleration")[0];
        if (!(made.largest_acceleration >= 0 && made.largest_acceleration < 1e300))
            throw_damaged("largest acceleration");
    }
    return made;
}

}  // namespace detail

}  // namespace firn::inline FIRN_BUILD
