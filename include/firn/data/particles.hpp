/// \file firn's own particles: named fields, each in blocks of sixteen, kept in the order of their blocks of cells.
/// A position is kept as a block of cells and a place in it, so that it is as fine in the farthest corner of the
/// largest domain as at the origin.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/memory.hpp>
#include <firn/data/particle_view.hpp>

#include <algorithm>
#include <limits>

namespace firn {

/// The fields of all particles, each [pack][component][lane], one after the other in one piece of memory, with room
/// for one more. Sorting moves every field into the room beside it, which thereby moves from one end to the other: no
/// second copy, and nothing is allocated while the number of slots fits.
template <class S>
class BlockedFields {
public:
    explicit BlockedFields(std::vector<int> components) : components_(std::move(components)) {
        offset_.resize(components_.size());
        widest_ = *std::max_element(components_.begin(), components_.end());
        for (int c : components_) width_ += c;
    }

    int components(std::size_t field) const { return components_[field]; }
    BlockedSpan<S> span(std::size_t field) { return {numbers_.data() + offset_[field], components_[field]}; }
    S get(std::size_t field, std::size_t slot, int component) const {
        return numbers_[offset_[field] + place(slot, components_[field]) + std::size_t(component * pack_size)];
    }
    const S* numbers(std::size_t field) const { return numbers_.data() + offset_[field]; }
    S& at(std::size_t field, std::size_t slot, int component) {
        return numbers_[offset_[field] + place(slot, components_[field]) + std::size_t(component * pack_size)];
    }
    /// Memory that holds nothing until the next permute(): the widest field's worth.
    std::byte* room() {
        const std::size_t end = offset_.back() + slots_ * std::size_t(components_.back());
        return reinterpret_cast<std::byte*>(numbers_.data() + (room_at_end_ ? end : 0));
    }
    std::size_t bytes() const { return numbers_.capacity() * sizeof(S); }
    std::size_t bytes_for(std::size_t slots) const { return needed(slots) * sizeof(S); }

    /// Makes the number of slots larger; the new ones are zero. Each worker writes its share of every field, and of the
    /// room.
    void grow(std::size_t slots, int workers) {
        BlockedFields larger(components_);
        larger.allocate(slots);
        const auto fill = [&](const S* from, std::size_t there, S* to, std::size_t size) {
            detail::copy_and_fill(from, there, to, size, S(0), workers);
        };
        for (std::size_t f = 0; f < components_.size(); ++f)
            fill(numbers_.data() + offset_[f], slots_ * std::size_t(components_[f]),
                 larger.numbers_.data() + larger.offset_[f], slots * std::size_t(components_[f]));
        const std::size_t room = slots * std::size_t(widest_);
        fill(nullptr, 0, larger.numbers_.data() + larger.numbers_.size() - room, room);
        *this = std::move(larger);
    }

    /// Puts the particle of slot order[i] into slot i; where there is none: anything.
    void permute(const aligned_vector<std::uint32_t>& order, int workers) {
        if (numbers_.size() < needed(order.size()))
            grow(order.size() + order.size() / 64 / pack_size * pack_size, workers);
        slots_ = order.size();
        const std::size_t count = components_.size();
        const bool to_the_end = room_at_end_;
        std::size_t end = to_the_end ? numbers_.size() : 0;  // of what has been moved
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t f = to_the_end ? count - 1 - i : i, size = slots_ * std::size_t(components_[f]);
            const std::size_t to = to_the_end ? end - size : end;
            move(f, order, numbers_.data() + to, workers);
            offset_[f] = to;
            end = to_the_end ? to : to + size;
        }
        room_at_end_ = !to_the_end;
    }

private:
    static constexpr std::size_t packs_at_once = 64;

    static std::size_t place(std::size_t slot, int components) {
        return slot / pack_size * std::size_t(components * pack_size) + slot % pack_size;
    }
    std::size_t needed(std::size_t slots) const { return slots * std::size_t(width_ + widest_); }

    void allocate(std::size_t slots) {
        slots_ = slots;
        numbers_.resize(needed(slots));
        std::size_t offset = 0;
        for (std::size_t f = 0; f < components_.size(); ++f) {
            offset_[f] = offset;
            offset += slots * std::size_t(components_[f]);
        }
    }

    void move(std::size_t field, const aligned_vector<std::uint32_t>& order, S* to, int workers) const {
        const S* from = numbers_.data() + offset_[field];
        const int components = components_[field];
        const auto move_one = [&](std::size_t pack, int) {
            move_pack(from, components, order.data() + pack * pack_size,
                      to + pack * std::size_t(components * pack_size));
        };
        parallel_for(order.size() / pack_size, workers, move_one, packs_at_once);
    }
    FIRN_INLINE static void move_pack(const S* from, int components, const std::uint32_t* order, S* to) {
        bool run = true;  // of slots, all along
        for (int l = 1; l < pack_size; ++l) run = run & (order[l] == order[0] + std::uint32_t(l));
        if (run) {
            const int first = int(order[0] % pack_size);
            const S* low = from + place(order[0], components);
            const S* high = from + place(order[pack_size - 1], components) - (pack_size - 1);
            for (int c = 0; c < components; ++c, low += pack_size, high += pack_size, to += pack_size)
                for (int l = 0; l < pack_size; ++l) to[l] = *((l < pack_size - first ? low : high) + l);
            return;
        }
        const S* of[pack_size];
        for (int l = 0; l < pack_size; ++l) of[l] = from + (order[l] == no_particle ? 0 : place(order[l], components));
        for (int c = 0; c < components; ++c, to += pack_size)
            for (int l = 0; l < pack_size; ++l) to[l] = of[l][c * pack_size];
    }

    std::vector<int> components_;
    std::vector<std::size_t> offset_;
    int width_ = 0, widest_ = 0;  // components: of all fields, of the widest
    std::size_t slots_ = 0;
    bool room_at_end_ = true;
    aligned_vector<S> numbers_;
};

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

/// What the material's state, the transfers and the grid need of every particle.
/// Bytes a particle in float, 3D, elastic: x 12 and the number of its block 4, v 12, C 36, τ 24, F 36, m 4, V0 4, id 4
/// = 136 (and padding, 1–3 % of dense matter); sorting moves fields through one field's worth of room, 36,
/// and the partition adds 4.
template <std::floating_point S, int D, class State = ElasticState<S, D>>
class Particles {
public:
    using View = ParticleView<S, D, BlockedSpan<S>, State>;
    static constexpr std::size_t state_fields = state_field_count<State>;

    /// \param domain  of the grid that they will meet; they may lie outside it
    explicit Particles(const Domain<D>& domain) : domain_(domain), fields_(components()) {}

    const Domain<D>& domain() const { return domain_; }
    std::size_t size() const { return size_; }
    std::size_t slots() const { return id_.size(); }

    /// Makes room for this many particles, and the padding that sorting adds to dense matter. Each worker is the first
    /// to write in its share of it.
    /// \param threads  0: as many as thread_count() says
    void reserve(std::size_t count, int threads = 0) {
        const std::size_t needed = (end_ - size_ + count + pack_size - 1) / pack_size * pack_size;
        if (needed > slots()) grow(needed + needed / 32 / pack_size * pack_size, count, threads);
    }

    /// The id of the next particle: no id is given out twice.
    std::uint32_t next_id() const { return next_id_; }

    /// Appends a particle; its id is the number of particles added before. Ends the order by blocks.
    /// \throws parameter_error  if all ids have been given out
    void push_back(const Vec<double, D>& x, const Vec<S, D>& v, S mass, S volume, const State& state = {}) {
        if (next_id_ == no_particle)
            throw parameter_error(sentence("All ", no_particle, " ids of particles have been given out."));
        if (end_ == slots()) {
            const std::size_t more =
                std::max<std::size_t>(4 * pack_size, slots() + slots() / 2 / pack_size * pack_size);
            grow(more, more, 0);
        }
        const std::size_t slot = end_++;
        set_position(slot, x);
        set_velocity(slot, v);
        fields_.at(of_mass, slot, 0) = mass;
        fields_.at(of_volume, slot, 0) = volume;
        set_state(slot, state);
        id_[slot] = next_id_++;
        ++size_;
    }

    /// Takes a particle out; its slot becomes padding, until particles are brought into order again.
    void remove(std::size_t slot) {
        if (!is_particle(slot)) return;
        id_[slot] = no_particle;
        make_padding(slot);
        --size_;
    }
    /// As many as that have been given out: those of particles that were taken out are not given again.
    void skip_ids(std::uint32_t next) { next_id_ = std::max(next_id_, next); }

    std::uint32_t id(std::size_t slot) const { return id_[slot]; }
    bool is_particle(std::size_t slot) const { return id_[slot] != no_particle; }
    /// x [m], rounded to S.
    Vec<S, D> position(std::size_t slot) const { return cast<S>(exact_position(slot)); }
    /// x [m], as fine as it is kept.
    Vec<double, D> exact_position(std::size_t slot) const {
        const BlockCoordinate<D> of = block(slot);
        Vec<double, D> x{};
        for (int a = 0; a < D; ++a) {
            x[a] = position_of_place(domain_, of, a, double(fields_.get(of_position, slot, a)));
            const double lower = domain_.lower[a], upper = domain_.upper[a];
            if (domain_.periodic[std::size_t(a)] && !(x[a] >= lower && x[a] <= upper))
                x[a] = std::clamp(x[a] < lower ? x[a] + (upper - lower) : x[a] - (upper - lower), lower, upper);
        }
        return x;
    }
    /// The block that the position counts from, and the position from there, in cells.
    BlockCoordinate<D> block(std::size_t slot) const { return block_of_key<D>(blocks_[block_[slot]]); }
    Vec<S, D> place(std::size_t slot) const { return vector(of_position, slot); }
    PlacesOfParticles<S> places() const {
        return {fields_.numbers(of_position), id_.data(), block_.data(), blocks_.data(), slots()};
    }
    Vec<S, D> velocity(std::size_t slot) const { return vector(of_velocity, slot); }
    Mat<S, D> affine(std::size_t slot) const { return matrix(of_affine, slot); }
    S mass(std::size_t slot) const { return fields_.get(of_mass, slot, 0); }
    S volume(std::size_t slot) const { return fields_.get(of_volume, slot, 0); }
    /// Kirchhoff stress τ [Pa] of the current state.
    Mat<S, D> stress(std::size_t slot) const {
        Mat<S, D> r{};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) r(i, j) = fields_.get(of_stress, slot, symmetric_index<D>(i, j));
        return r;
    }
    State state(std::size_t slot) const {
        State state{};
        constexpr auto members = State::fields();
        unroll<int(state_fields)>([&](auto f) {
            auto& member = state.*(std::get<f>(members).member);
            auto* to = detail::components(member);
            for (int k = 0; k < fields_.components(of_state + f); ++k) to[k] = fields_.get(of_state + f, slot, k);
        });
        return state;
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
        set(of_position, slot, place.v);
    }
    void set_velocity(std::size_t slot, const Vec<S, D>& v) { set(of_velocity, slot, v.v); }
    void set_affine(std::size_t slot, const Mat<S, D>& C) { set(of_affine, slot, C.m); }
    void set_stress(std::size_t slot, const Mat<S, D>& stress) {
        for (int i = 0; i < D; ++i)
            for (int j = i; j < D; ++j) fields_.at(of_stress, slot, symmetric_index<D>(i, j)) = stress(i, j);
    }
    void set_state(std::size_t slot, State state) {
        constexpr auto members = State::fields();
        unroll<int(state_fields)>(
            [&](auto f) { set(of_state + f, slot, detail::components(state.*(std::get<f>(members).member))); });
    }

    View view() {
        View view{fields_.span(of_position),
                  fields_.span(of_velocity),
                  fields_.span(of_affine),
                  fields_.span(of_stress),
                  fields_.span(of_mass),
                  fields_.span(of_volume),
                  {}};
        for (std::size_t f = 0; f < state_fields; ++f) view.state[f] = fields_.span(of_state + f);
        return view;
    }

    /// Memory that holds nothing until particles are moved: at least D² numbers a slot.
    std::byte* room() { return fields_.room(); }

    /// Moves all particles into the order of the partition, whose order then names ids.
    void reorder(BlockPartition<D>& partition, int workers) {
        aligned_vector<std::uint32_t>& order = partition.order;
        const auto for_groups = [&](const auto& body) {
            parallel_for(partition.groups.size(), workers, [&](std::size_t g, int) { body(partition.groups[g]); }, 64);
        };
        fields_.permute(order, workers);

        for_groups([&](const BlockGroup& group) {
            for_slots(partition, group, [&](std::size_t slot, std::size_t r) {
                const BlockCoordinate<D>& block = partition.ranges[r].block;
                const std::uint64_t old_key = blocks_[block_[order[slot]]];
                order[slot] = id_[order[slot]];
                if (old_key == block_key<D>(block)) return;
                const BlockCoordinate<D> old = block_of_key<D>(old_key);
                for (std::size_t a = 0; a < std::size_t(D); ++a)
                    fields_.at(of_position, slot, int(a)) +=
                        S(block_size * block_distance(domain_, int(a), old[a], block[a]));
            });
            for_padding(group, [&](std::size_t slot) { make_padding(slot); });
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

private:
    enum Field : std::size_t { of_position, of_velocity, of_affine, of_stress, of_mass, of_volume, of_state };

    static std::vector<int> components() {
        std::vector<int> all{D, D, D * D, symmetric_size<D>, 1, 1};
        constexpr auto members = State::fields();
        unroll<int(state_fields)>([&](auto f) {
            using Member = std::remove_cvref_t<decltype(std::declval<State>().*(std::get<f>(members).member))>;
            all.push_back(component_count<Member>);
        });
        return all;
    }
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
    void make_padding(std::size_t slot) {
        for (const std::size_t f : {of_velocity, of_affine, of_stress, of_mass, of_volume})
            for (int k = 0; k < fields_.components(f); ++k) fields_.at(f, slot, k) = 0;
        for (int a = 0; a < D; ++a) fields_.at(of_position, slot, a) = S(block_size / 2);
        set_state(slot, State{});
    }
    Vec<S, D> vector(std::size_t field, std::size_t slot) const {
        Vec<S, D> r{};
        for (int a = 0; a < D; ++a) r[a] = fields_.get(field, slot, a);
        return r;
    }
    Mat<S, D> matrix(std::size_t field, std::size_t slot) const {
        Mat<S, D> r{};
        for (int k = 0; k < D * D; ++k) r.m[k] = fields_.get(field, slot, k);
        return r;
    }
    void set(std::size_t field, std::size_t slot, const S* numbers) {
        for (int k = 0; k < fields_.components(field); ++k) fields_.at(field, slot, k) = numbers[k];
    }

    static constexpr double most_blocks_per_axis = 1 << 20;

    Domain<D> domain_;
    std::size_t size_ = 0;  ///< particles
    std::uint32_t next_id_ = 0;
    std::size_t end_ = 0;  ///< slots in use, padding included
    BlockedFields<S> fields_;
    aligned_vector<std::uint32_t> id_;
    aligned_vector<std::uint32_t> block_;  // of each slot: which of blocks_ its position counts from
    std::vector<std::uint64_t> blocks_;    // keys
};

}  // namespace firn
