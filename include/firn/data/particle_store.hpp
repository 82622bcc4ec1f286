/// \file firn's own particles, whatever their material: named fields, kept in the order of their blocks of cells.
/// A position is kept as a block of cells and a place in it, so that it is as fine in the farthest corner of the
/// largest domain as at the origin.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/field_memory.hpp>
#include <firn/data/ids.hpp>
#include <firn/data/memory.hpp>
#include <firn/data/particle_view.hpp>

#include <algorithm>
#include <span>

namespace firn {

/// Where particles are, whatever else they carry: what sorting reads.
template <std::floating_point S>
struct PlacesOfParticles {
    const S* places;             ///< [pack][axis][lane]: from the lower corner of the particle's block, in cells
    const std::uint32_t* id;     ///< of each slot
    const std::uint32_t* block;  ///< of each slot: which of `keys`
    const std::uint64_t* keys;
    std::size_t slots;

    bool is_particle(std::size_t slot) const { return id[slot] != no_particle; }
    std::uint64_t block_key(std::size_t slot) const { return keys[block[slot]]; }
};

/// Particles with the fields of a table, of which the first are the built-in ones.
template <std::floating_point S, int D>
class ParticleStore {
    using BuiltIn = ParticleView<S, D, BlockedSpan<S>>;

public:
    /// The line of the table that is set with the block: \see set_place
    static constexpr std::size_t place_field = BuiltIn::line_of(&BuiltIn::position);

    /// \param domain  of the grid that they will meet; they may lie outside it
    ParticleStore(const Domain<D>& domain, FieldTable table)
        : domain_(domain), table_(std::move(table)), fields_(table_, D, sizeof(S), SlotOrder::sorted) {}

    const Domain<D>& domain() const { return domain_; }
    std::size_t size() const { return size_; }
    std::size_t slots() const { return id_.size(); }
    /// What each particle carries.
    const FieldTable& table() const { return table_; }

    /// Makes room for this many particles, and the padding that sorting adds to dense matter. Each worker is the first
    /// to write in its share of it.
    /// \param threads  0: as many as thread_count() says
    void reserve(std::size_t count, int threads = 0) {
        const std::size_t needed = (end_ - size_ + count + pack_size - 1) / pack_size * pack_size;
        if (needed > slots()) grow(needed + needed / 32 / pack_size * pack_size, count, threads);
    }

    /// The id of the next particle: no id is given out twice.
    std::uint32_t next_id() const { return ids_.next(); }

    /// Appends a particle at x [m] that has its start in every other field; its id is the number of particles added
    /// before. Ends the order by blocks.
    /// \return its slot
    /// \throws parameter_error  if all ids have been given out
    std::size_t push_back(const Vec<double, D>& x) {
        ids_.require(1);
        if (end_ == slots()) {
            const std::size_t more =
                std::max<std::size_t>(4 * pack_size, slots() + slots() / 2 / pack_size * pack_size);
            grow(more, more, 0);
        }
        const std::size_t slot = end_++;
        set_start(slot);
        set_position(slot, x);
        id_[slot] = ids_.give();
        ++size_;
        return slot;
    }

    /// Takes a particle out; its slot becomes padding, until particles are brought into order again.
    void remove(std::size_t slot) {
        if (!is_particle(slot)) return;
        id_[slot] = no_particle;
        set_start(slot);
        --size_;
    }
    /// As many as that have been given out: those of particles that were taken out are not given again.
    void skip_ids(std::uint32_t next) { ids_.skip(next); }

    std::uint32_t id(std::size_t slot) const { return id_[slot]; }
    bool is_particle(std::size_t slot) const { return id_[slot] != no_particle; }
    /// x [m], rounded to S.
    Vec<S, D> position(std::size_t slot) const { return cast<S>(exact_position(slot)); }
    /// x [m], as fine as it is kept.
    Vec<double, D> exact_position(std::size_t slot) const {
        const BlockCoordinate<D> of = block(slot);
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a) {
            x[a] = position_of_place(domain_, of, a, double(fields_.template at<S>(of_place, slot, a)));
            const double lower = domain_.lower[a], upper = domain_.upper[a];
            if (domain_.periodic[std::size_t(a)] && !(x[a] >= lower && x[a] <= upper))
                x[a] = std::clamp(x[a] < lower ? x[a] + (upper - lower) : x[a] - (upper - lower), lower, upper);
        }
        return x;
    }
    /// The block that the position counts from, and the position from there, in cells.
    BlockCoordinate<D> block(std::size_t slot) const { return block_of_key<D>(blocks_[block_[slot]]); }
    Vec<S, D> place(std::size_t slot) const { return vector(of_place, slot); }
    PlacesOfParticles<S> places() const {
        return {fields_.template numbers<S>(of_place), id_.data(), block_.data(), blocks_.data(), slots()};
    }
    Vec<S, D> velocity(std::size_t slot) const { return vector(of_velocity, slot); }
    Mat<S, D> affine(std::size_t slot) const { return matrix(of_affine, slot); }
    S mass(std::size_t slot) const { return fields_.template at<S>(of_mass, slot, 0); }
    S volume(std::size_t slot) const { return fields_.template at<S>(of_volume, slot, 0); }
    /// Kirchhoff stress τ [Pa] of the current state.
    Mat<S, D> stress(std::size_t slot) const { return matrix(of_stress, slot); }

    /// A number of a field of the table, as it is kept.
    S number(std::size_t field, std::size_t slot, int component) const {
        return fields_.template at<S>(field, slot, component);
    }
    /// A particle's numbers of a field of the table, as states have them: matrices row by row, symmetric ones whole.
    /// \param to  FieldInfo::components_in_state() numbers
    void get(std::size_t field, std::size_t slot, S* to) const {
        const FieldInfo& info = table_[field];
        for (int k = 0; k < info.components_in_state(D); ++k)
            to[k] = fields_.template at<S>(field, slot, info.component_of(D, k));
    }
    /// The numbers as get() gives them. Of a symmetric matrix the upper triangle is taken.
    void set(std::size_t field, std::size_t slot, const S* from) {
        const FieldInfo& info = table_[field];
        for (int k = info.components_in_state(D) - 1; k >= 0; --k)
            fields_.template at<S>(field, slot, info.component_of(D, k)) = from[k];
    }

    void set_position(std::size_t slot, const Vec<double, D>& x) {
        BlockCoordinate<D> of{};
        Vec<S, D> place{};
        for (int a = 0; a < D; ++a) {
            const double cells = (x[a] - domain_.lower[a]) / domain_.cell_size;
            const double block = std::floor(cells / block_size);
            of[std::size_t(a)] = std::abs(block) < most_blocks_per_axis ? int(block) : 0;  // 0: also for NaN
            place[a] = S(cells - block_size * double(of[std::size_t(a)]));
        }
        set_place(slot, wrapped(domain_, of), place);
    }
    void set_place(std::size_t slot, const BlockCoordinate<D>& of, const Vec<S, D>& place) {
        const std::uint64_t key = block_key<D>(of);
        if (blocks_.empty() || blocks_.back() != key) blocks_.push_back(key);
        block_[slot] = std::uint32_t(blocks_.size() - 1);
        put(of_place, slot, place.v, D);
    }
    void set_velocity(std::size_t slot, const Vec<S, D>& v) { put(of_velocity, slot, v.v, D); }
    void set_affine(std::size_t slot, const Mat<S, D>& C) { put(of_affine, slot, C.m, D * D); }
    void set_mass(std::size_t slot, S mass) { put(of_mass, slot, &mass, 1); }
    void set_volume(std::size_t slot, S volume) { put(of_volume, slot, &volume, 1); }
    void set_stress(std::size_t slot, const Mat<S, D>& stress) {
        for (int i = 0; i < D; ++i)
            for (int j = i; j < D; ++j)
                fields_.template at<S>(of_stress, slot, symmetric_index<D>(i, j)) = stress(i, j);
    }

    /// Memory that holds nothing until particles are moved: at least D² numbers a slot.
    std::byte* room() { return fields_.room(); }

    /// Moves all particles into the order of the partition, whose order then names ids.
    void reorder(BlockPartition<D>& partition, int workers) {
        aligned_vector<std::uint32_t>& order = partition.order;
        const auto for_groups = [&](const auto& body) {
            parallel_for(partition.groups.size(), workers, [&](std::size_t g, int) { body(partition.groups[g]); }, 64);
        };
        fields_.template permute<std::conditional_t<sizeof(S) == 4, std::uint32_t, std::uint64_t>>(order, workers);

        for_groups([&](const BlockGroup& group) {
            for_slots(partition, group, [&](std::size_t slot, std::size_t r) {
                const BlockCoordinate<D>& block = partition.ranges[r].block;
                const std::uint64_t old_key = blocks_[block_[order[slot]]];
                order[slot] = id_[order[slot]];
                if (old_key == block_key<D>(block)) return;
                const BlockCoordinate<D> old = block_of_key<D>(old_key);
                for (std::size_t a = 0; a < std::size_t(D); ++a)
                    fields_.template at<S>(of_place, slot, int(a)) +=
                        S(block_size * block_distance(domain_, int(a), old[a], block[a]));
            });
            for_padding(group, [&](std::size_t slot) { set_start(slot); });
        });
        for (aligned_vector<std::uint32_t>* of_slots : {&id_, &block_}) {
            of_slots->clear();
            if (of_slots->capacity() < order.size()) of_slots->reserve(order.size() + order.size() / 64);
            of_slots->resize(order.size());
        }
        for_groups([&](const BlockGroup& group) {
            for_slots(partition, group, [&](std::size_t slot, std::size_t r) {
                id_[slot] = order[slot];
                block_[slot] = std::uint32_t(r);
            });
            for_padding(group, [&](std::size_t slot) {
                id_[slot] = no_particle;
                block_[slot] = group.first_range + group.ranges - 1;
            });
        });
        end_ = order.size();
        blocks_.resize(partition.ranges.size());
        for (std::size_t r = 0; r < blocks_.size(); ++r) blocks_[r] = block_key<D>(partition.ranges[r].block);
    }

    /// Of memory held.
    std::size_t bytes() const {
        return fields_.bytes() + blocks_.capacity() * sizeof(std::uint64_t) +
               (id_.capacity() + block_.capacity()) * sizeof(std::uint32_t);
    }

protected:
    BlockedSpan<S> span(std::size_t field) { return {fields_.template numbers<S>(field), fields_.components(field)}; }
    S* numbers_of(std::size_t field, std::size_t slot) { return &fields_.template at<S>(field, slot, 0); }
    const S* numbers_of(std::size_t field, std::size_t slot) const { return &fields_.template at<S>(field, slot, 0); }
    static constexpr std::size_t built_in_fields = BuiltIn::built_in().size();

private:
    static constexpr std::size_t of_place = place_field, of_velocity = BuiltIn::line_of(&BuiltIn::velocity),
                                 of_affine = BuiltIn::line_of(&BuiltIn::affine),
                                 of_stress = BuiltIn::line_of(&BuiltIn::stress),
                                 of_mass = BuiltIn::line_of(&BuiltIn::mass),
                                 of_volume = BuiltIn::line_of(&BuiltIn::volume);

    /// body(slot, number of its range) for the particles of a group.
    template <class Body>
    static void for_slots(const BlockPartition<D>& partition, const BlockGroup& group, const Body& body) {
        for (std::size_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
            const BlockRange<D>& range = partition.ranges[r];
            for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) body(slot, r);
        }
    }
    /// body(slot) for the rest of a group's last pack.
    template <class Body>
    static void for_padding(const BlockGroup& group, const Body& body) {
        for (std::size_t i = group.particles; i < group.packs() * pack_size; ++i) body(group.first_slot + i);
    }
    /// \throws memory_error  if there is not enough for so many
    void grow(std::size_t slots, std::size_t particles, int threads) {
        require_memory(
            double(fields_.bytes()) + double(fields_.bytes_for(slots)) + double(slots) * 2 * sizeof(std::uint32_t),
            sentence("Room for ", particles, " particles"), "Take fewer: a larger spacing, a smaller body.");
        const int workers = thread_count(threads);
        parallel_region(workers, [&] {
            fields_.grow(slots, workers);
            firn::grow(id_, slots, no_particle, workers);
            firn::grow(block_, slots, {}, workers);
        });
    }
    /// Padding is inert: at rest, undeformed, massless, in the middle of its block.
    void set_start(std::size_t slot) {
        for (std::size_t f = 0; f < table_.size(); ++f)
            for (int k = 0; k < fields_.components(f); ++k)
                fields_.template at<S>(f, slot, k) = S(table_[f].start[std::size_t(k)]);
    }
    Vec<S, D> vector(std::size_t field, std::size_t slot) const {
        Vec<S, D> r{};
        for (int a = 0; a < D; ++a) r[a] = fields_.template at<S>(field, slot, a);
        return r;
    }
    Mat<S, D> matrix(std::size_t field, std::size_t slot) const {
        Mat<S, D> r{};
        for (int k = 0; k < D * D; ++k)
            r(k / D, k % D) = fields_.template at<S>(field, slot, table_[field].component_of(D, k));
        return r;
    }
    void put(std::size_t field, std::size_t slot, const S* numbers, int components) {
        for (int k = 0; k < components; ++k) fields_.template at<S>(field, slot, k) = numbers[k];
    }

    static constexpr double most_blocks_per_axis = 1 << 20;

    Domain<D> domain_;
    FieldTable table_;
    std::size_t size_ = 0;  ///< particles
    Ids ids_;
    std::size_t end_ = 0;  ///< slots in use, padding included
    FieldMemory fields_;
    aligned_vector<std::uint32_t> id_;
    aligned_vector<std::uint32_t> block_;  // of each slot: which of blocks_ its position counts from
    std::vector<std::uint64_t> blocks_;    // keys
};

/// The slots of all particles in the order of their ids.
template <std::floating_point S, int D>
std::vector<std::uint32_t> slots_by_id(const ParticleStore<S, D>& particles, int threads) {
    if (particles.next_id() / 8 > particles.size()) {  // few are left of those that there were
        std::vector<std::uint32_t> slots;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) slots.push_back(std::uint32_t(slot));
        std::ranges::sort(slots, {}, [&](std::uint32_t slot) { return particles.id(slot); });
        return slots;
    }
    std::vector<std::uint32_t> slot_of(particles.next_id(), no_particle);
    detail::for_chunks(particles.slots(), threads, [&](std::size_t first, std::size_t last) {
        for (std::size_t slot = first; slot < last; ++slot)
            if (particles.is_particle(slot)) slot_of[particles.id(slot)] = std::uint32_t(slot);
    });
    if (particles.size() < slot_of.size()) std::erase(slot_of, no_particle);
    return slot_of;
}

}  // namespace firn
