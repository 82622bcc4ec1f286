/// \file firn's own particles, for any material. Each particle has named fields; particles are sorted by blocks of
/// cells.
///
/// The position of a particle is stored as a block and a position within this block. So positions are as precise in the
/// farthest corner of the largest domain as at the origin.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/field_memory.hpp>
#include <firn/data/ids.hpp>
#include <firn/data/memory.hpp>
#include <firn/data/particle_view.hpp>

#include <algorithm>
#include <cstring>
#include <span>

namespace firn::inline FIRN_BUILD {

/// The positions and ids of all particles: the data that sorting reads.
template <std::floating_point S>
struct PlacesOfParticles {
    /// positions [cells], each counted from the lower corner of the particle's block, in the order [pack][axis][lane]
    const S* places;
    const std::uint32_t* id;     ///< id of the particle in each slot, or no_particle
    const std::uint32_t* block;  ///< for each slot, the index in `keys` of the particle's block
    const std::uint64_t* keys;   ///< keys of blocks. \see firn::block_key
    std::size_t slots;           ///< number of slots
    bool grouped;                ///< true if a particle may be in a contact group other than 0

    /// True if the slot holds a particle, false if the slot is padding.
    bool is_particle(std::size_t slot) const { return id[slot] != no_particle; }
    /// Returns the key of the block from whose lower corner the position in a slot is counted.
    std::uint64_t block_key(std::size_t slot) const { return keys[block[slot]]; }
};

/// Stores particles whose fields are described by a table. In the table, the built-in fields come first.
template <std::floating_point S, int D>
class ParticleStore {
    using BuiltIn = MotionView<S, D, BlockedSpan<S>>;

public:
    /// Index (in the table) of the field `place`, a particle's position within its block. \see set_place
    static constexpr std::size_t place_field = BuiltIn::line_of(&BuiltIn::position);

    /// Makes a store without particles.
    /// \param domain  domain of the grid; particles may lie outside the domain
    /// \param table   description of a particle's fields
    ParticleStore(const Domain<D>& domain, FieldTable table)
        : domain_(domain), table_(std::move(table)), fields_(table_, D, sizeof(S), SlotOrder::sorted) {}

    /// The domain of the grid.
    const Domain<D>& domain() const { return domain_; }
    /// Number of particles.
    std::size_t size() const { return size_; }
    /// Number of slots, including those of padding and those reserved for more particles.
    std::size_t slots() const { return id_.size(); }
    /// Number of slots in use, including those of padding: particles lie in slots below this number.
    std::size_t used_slots() const { return end_; }
    /// Returns the table of a particle's fields.
    const FieldTable& table() const { return table_; }

    /// Reserves memory for `count` particles in all, and for the padding that sorting adds if matter is dense. If this
    /// needs new memory, each worker (thread) is the first to write to its part of the memory.
    /// \param threads  number of threads; 0: thread_count() chooses
    /// \throws memory_error  if the particles do not fit into memory
    void reserve(std::size_t count, int threads = 0) {
        const std::size_t needed = (end_ - size_ + count + pack_size - 1) / pack_size * pack_size;
        if (needed > slots()) grow(needed + needed / 32 / pack_size * pack_size, count, threads);
    }

    /// Returns the id that the next new particle will get. No two particles get the same id.
    std::uint32_t next_id() const { return ids_.next(); }

    /// Appends a particle at x [m]. All other fields get their start values. The new particle gets the id that
    /// next_id() returned before this call. Particles must be sorted again before the next step.
    /// \return the slot of the new particle
    /// \throws parameter_error  if all ids have been given out
    /// \throws memory_error     if there is no memory for more slots
    std::size_t push_back(const Vec<double, D>& x);

    /// Removes the particle in a slot; does nothing if the slot is padding. The slot is then padding until particles
    /// are sorted again.
    void remove(std::size_t slot);
    /// Returns how many ids can still be given out.
    std::uint32_t ids_left() const { return no_particle - ids_.next(); }
    /// Marks all ids below `next` as given out, so that no new particle gets one of them. This keeps the ids of removed
    /// particles from being given out again.
    void skip_ids(std::uint32_t next) { ids_.skip(next); }

    /// Returns the id of the particle in a slot, or no_particle if the slot is padding.
    std::uint32_t id(std::size_t slot) const { return id_[slot]; }
    /// True if the slot holds a particle, false if the slot is padding.
    bool is_particle(std::size_t slot) const { return id_[slot] != no_particle; }
    /// Returns the position x [m] of the particle in a slot, rounded to type S.
    Vec<S, D> position(std::size_t slot) const { return cast<S>(exact_position(slot)); }
    /// Returns the position x [m] of the particle in a slot, in the precision in which it is stored. Along periodic
    /// axes, x lies in the domain.
    Vec<double, D> exact_position(std::size_t slot) const {
        const BlockCoordinate<D> of = block(slot);
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a)
            x[a] = into_domain(domain_, a,
                               position_of_place(domain_, of, a, double(fields_.template at<S>(of_place, slot, a))));
        return x;
    }
    /// Returns the coordinates of the block from whose lower corner the position of the particle in a slot is counted.
    BlockCoordinate<D> block(std::size_t slot) const { return block_of_key<D>(blocks_[block_[slot]]); }
    /// Returns the stored position of the particle in a slot [cells], counted from the lower corner of block(slot).
    Vec<S, D> place(std::size_t slot) const { return vector(of_place, slot); }
    /// Returns the addresses of the arrays that sorting reads. The addresses are valid until the store is changed.
    PlacesOfParticles<S> places() const {
        return {fields_.template numbers<S>(of_place), id_.data(), block_.data(), blocks_.data(), slots(), grouped_};
    }
    /// Returns the velocity v [m/s] of the particle in a slot.
    Vec<S, D> velocity(std::size_t slot) const { return vector(of_velocity, slot); }
    /// Returns the affine velocity matrix C [1/s] of the particle in a slot.
    Mat<S, D> affine(std::size_t slot) const { return matrix(of_affine, slot); }
    /// Returns the mass m [kg] of the particle in a slot.
    S mass(std::size_t slot) const { return fields_.template at<S>(of_mass, slot, 0); }
    /// Returns the initial volume V0 [m^D] of the particle in a slot.
    S volume(std::size_t slot) const { return fields_.template at<S>(of_volume, slot, 0); }
    /// Returns the Kirchhoff stress τ [Pa] of the particle in a slot, for the particle's current state.
    Mat<S, D> stress(std::size_t slot) const { return matrix(of_stress, slot); }

    /// Returns one component of a field of the particle in a slot, as it is stored. \param field  index of the field in
    /// the table
    S number(std::size_t field, std::size_t slot, int component) const {
        return fields_.template at<S>(field, slot, component);
    }
    /// Sets one component of a field of the particle in a slot, as it is stored. \see number
    void set_number(std::size_t field, std::size_t slot, int component, S number) {
        fields_.template at<S>(field, slot, component) = number;
    }
    /// Returns the address, for reading only, of the first component of a field of the particle in a slot. Component k
    /// lies k · pack_size numbers after the first.
    const S* numbers_of(std::size_t field, std::size_t slot) const { return &fields_.template at<S>(field, slot, 0); }
    /// Copies all components of a field of the particle in a slot to `to`, in the order of saved states: matrices are
    /// row by row, and symmetric matrices have all D² elements.
    /// \param field  index of the field in the table
    /// \param to     memory for FieldInfo::components_in_state() numbers
    void get(std::size_t field, std::size_t slot, S* to) const;
    /// Copies the remainders of a field that is stored less 1. \see FieldInfo::remainder_name
    /// \param to  memory for FieldInfo::components_less_one() numbers
    void get_remainders(std::size_t field, std::size_t slot, S* to) const;
    /// Sets all components of a field of the particle in a slot. In `from`, the components have the order of get(). Of
    /// a symmetric matrix, only the upper triangle is used.
    /// \param field       index of the field in the table
    /// \param remainders  of a field that is stored less 1: the numbers of get_remainders(), or nullptr if they are 0
    /// \tparam T          type of the numbers; they are rounded to S last
    template <std::floating_point T>
    void set(std::size_t field, std::size_t slot, const T* from, const T* remainders = nullptr) {
        const FieldInfo& info = table_[field];
        int left = info.components_less_one(D);
        for (int k = info.components_in_state(D) - 1; k >= 0; --k) {
            T number = from[k];
            if (info.is_less_one(D, k)) number = (number - T(1)) + (remainders ? remainders[--left] : T(0));
            fields_.template at<S>(field, slot, info.component_of(D, k)) = S(number);
        }
    }

    /// Returns the contact group of the particle in a slot.
    int contact_group(std::size_t slot) const {
        return grouped_ ? group_of_copy(block(slot)[0], copy_stride(domain_)) : 0;
    }
    /// Returns whether a particle may be in a contact group other than 0.
    bool has_contact_groups() const { return grouped_; }
    /// Puts the particle in a slot into a contact group. Particles must be sorted again before the next step.
    /// \param group  from 0 to most_contact_groups(domain()) − 1
    void set_contact_group(std::size_t slot, int group) {
        BlockCoordinate<D> of = block(slot);
        of[0] += (group - contact_group(slot)) * copy_stride(domain_);
        set_block(slot, block_key<D>(of));
    }

    /// Sets the position x [m] of the particle in a slot. The particle stays in its contact group.
    void set_position(std::size_t slot, const Vec<double, D>& x) { set_position(slot, x, contact_group(slot)); }
    /// Sets the position x [m] and the contact group of the particle in a slot. A position that lies outside of the
    /// domain by rounding is moved to the face. \see rounding_at_faces
    void set_position(std::size_t slot, const Vec<double, D>& x, int group);
    /// Sets the position of the particle in a slot, given by a block and a position within the block.
    /// \param of     coordinates of a block, or of a copy of it
    /// \param place  position within the block [cells], counted from the block's lower corner
    void set_place(std::size_t slot, const BlockCoordinate<D>& of, const Vec<S, D>& place) {
        set_block(slot, block_key<D>(of));
        put(of_place, slot, place.v, D);
    }
    /// Sets the velocity v [m/s] of the particle in a slot.
    void set_velocity(std::size_t slot, const Vec<S, D>& v) { put(of_velocity, slot, v.v, D); }
    /// Sets the affine velocity matrix C [1/s] of the particle in a slot.
    void set_affine(std::size_t slot, const Mat<S, D>& C) { put(of_affine, slot, C.m, D * D); }
    /// Sets the mass m [kg] of the particle in a slot.
    void set_mass(std::size_t slot, S mass) { put(of_mass, slot, &mass, 1); }
    /// Sets the initial volume V0 [m^D] of the particle in a slot.
    void set_volume(std::size_t slot, S volume) { put(of_volume, slot, &volume, 1); }
    /// Sets the Kirchhoff stress τ [Pa] of the particle in a slot. Only the upper triangle of `stress` is read.
    void set_stress(std::size_t slot, const Mat<S, D>& stress) {
        for (int i = 0; i < D; ++i)
            for (int j = i; j < D; ++j)
                fields_.template at<S>(of_stress, slot, symmetric_index<D>(i, j)) = stress(i, j);
    }

    /// \name Records
    /// A record is one particle with all that the store keeps of it, to move it to the store of another process.
    /// @{

    /// Size of a record [bytes].
    std::size_t record_bytes() const {
        std::size_t numbers = 0;
        for (std::size_t f = 0; f < table_.size(); ++f) numbers += std::size_t(fields_.components(f));
        return sizeof(std::uint64_t) + sizeof(std::uint32_t) + numbers * sizeof(S);
    }
    /// Writes the record of the particle in a slot: the key of its block, its id, then the numbers of its fields.
    /// \param to  memory of record_bytes() bytes
    void write_record(std::size_t slot, std::byte* to) const;
    /// Returns the first slot from `slot` on that holds no particle; slots() if there is none.
    std::size_t free_slot(std::size_t slot) const {
        while (slot < slots() && is_particle(slot)) ++slot;
        return slot;
    }
    /// Lets reorder() leave at least this many slots free behind all others, for particles that will come.
    void keep_free(std::size_t slots) { spare_ = (slots + pack_size - 1) / pack_size * pack_size; }
    /// Puts the particle of a record into a slot that holds no particle. The particle keeps its id. Particles must be
    /// sorted again before the next step.
    /// \param slot  a slot below slots(). \see reserve, free_slot
    void put_record(std::size_t slot, const std::byte* from);
    /// @}

    /// Returns the address of scratch memory for at least D² numbers of type S per slot. The memory may be used until
    /// reorder() is called.
    std::byte* room() { return fields_.room(); }

    /// Moves all particles into the order of a partition. Afterwards, partition.order contains the particles' ids.
    /// \param partition  the partition of these particles; its `order` contains their old slots
    /// \param workers    number of workers, at least 1
    void reorder(BlockPartition<D>& partition, int workers);

    /// Gives the memory of all fields away, and takes `other` in its place. \return the memory that the store had
    FieldMemory exchange_fields(FieldMemory other) { return std::exchange(fields_, std::move(other)); }

    /// Returns the arrays that P2G and contact read. The addresses are valid until the store is changed.
    BuiltIn motion();

    /// Size of the memory that the store has allocated [bytes].
    std::size_t bytes() const {
        return fields_.bytes() + blocks_.capacity() * sizeof(std::uint64_t) +
               (id_.capacity() + block_.capacity()) * sizeof(std::uint32_t);
    }

    /// Calls f(array, first, count) for each array that the store has allocated. What the store knows of its particles
    /// is in `count` entries from entry `first` on.
    template <class F>
    void for_arrays(const F& f) {
        fields_.for_arrays(f);
        f(id_, 0, id_.size()), f(block_, 0, block_.size()), f(blocks_, 0, blocks_.size());
    }

protected:
    /// Returns the array of a field. \param field  index of the field in the table
    BlockedSpan<S> span(std::size_t field) { return {fields_.template numbers<S>(field), fields_.components(field)}; }
    /// Returns the address of the first component of a field of the particle in a slot. Component k lies k · pack_size
    /// numbers after the first.
    S* numbers_of(std::size_t field, std::size_t slot) { return &fields_.template at<S>(field, slot, 0); }
    /// Number of built-in fields, which every particle has.
    static constexpr std::size_t built_in_fields = BuiltIn::built_in().size();

private:
    static constexpr std::size_t of_place = place_field, of_velocity = BuiltIn::line_of(&BuiltIn::velocity),
                                 of_affine = BuiltIn::line_of(&BuiltIn::affine),
                                 of_stress = BuiltIn::line_of(&BuiltIn::stress),
                                 of_mass = BuiltIn::line_of(&BuiltIn::mass),
                                 of_volume = BuiltIn::line_of(&BuiltIn::volume);

    /// Calls body(slot, r) for each particle of a group of blocks, where r is the index of the particle's range (the
    /// particles of one block).
    template <class Body>
    static void for_slots(const BlockPartition<D>& partition, const BlockGroup& group, const Body& body) {
        for (std::size_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
            const BlockRange<D>& range = partition.ranges[r];
            for (std::size_t slot = range.first_slot; slot < range.first_slot + range.particles; ++slot) body(slot, r);
        }
    }
    /// Calls body(slot) for each slot of padding in the last pack of a group of blocks.
    template <class Body>
    static void for_padding(const BlockGroup& group, const Body& body) {
        for (std::size_t i = group.particles; i < group.packs() * pack_size; ++i) body(group.first_slot + i);
    }
    /// Returns the next unused slot. Increases the number of slots if there is none.
    std::size_t new_slot();
    void set_block(std::size_t slot, std::uint64_t key);
    /// Increases the number of slots, and keeps the particles.
    /// \param slots      the new number of slots
    /// \param particles  number of particles to report in the error message
    /// \throws memory_error  if there is no memory for this many slots
    void grow(std::size_t slots, std::size_t particles, int threads);
    /// Sets all fields in a slot to their start values. Padding with these values has no effect: it is at rest,
    /// undeformed and massless, and lies in the middle of its block.
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
    Mat<S, D> matrix(std::size_t field, std::size_t slot) const;
    void put(std::size_t field, std::size_t slot, const S* numbers, int components) {
        for (int k = 0; k < components; ++k) fields_.template at<S>(field, slot, k) = numbers[k];
    }

    static constexpr double most_blocks_per_axis = 1 << 20;

    Domain<D> domain_;
    FieldTable table_;
    std::size_t size_ = 0;  // number of particles
    Ids ids_;
    bool grouped_ = false;   // whether a particle may be in a contact group other than 0
    std::size_t end_ = 0;    // number of slots in use, including padding
    std::size_t spare_ = 0;  // number of slots that reorder() leaves free behind those in use
    FieldMemory fields_;
    aligned_vector<std::uint32_t> id_;
    aligned_vector<std::uint32_t> block_;  // for each slot, the index in blocks_ of the particle's block
    std::vector<std::uint64_t> blocks_;    // keys of blocks
};

/// Returns the slots of all particles, sorted by the particles' ids.
/// \param threads  number of threads; 0: thread_count() chooses
template <std::floating_point S, int D>
std::vector<std::uint32_t> slots_by_id(const ParticleStore<S, D>& particles, int threads) {
    if (particles.next_id() / 8 > particles.size()) {  // most of the particles ever added have been removed
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

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES
#include <firn/data/particle_store-inl.hpp>
#endif
