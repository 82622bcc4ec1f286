/// \file firn's own particles: named fields, each in blocks of sixteen, kept in the order of their blocks of cells.
#pragma once

#include <firn/data/block_partition.hpp>
#include <firn/data/particle_view.hpp>

namespace firn {

/// One field of all particles: [pack][component][lane].
template <class S>
class BlockedField {
public:
    BlockedField() = default;
    explicit BlockedField(int components) : components_(components) {}

    int components() const { return components_; }
    BlockedSpan<S> span() { return {numbers_.data(), components_}; }
    /// A read-only use of the same addressing.
    S get(std::size_t slot, int component) const {
        return numbers_[(slot / pack_size * std::size_t(components_) + std::size_t(component)) * pack_size +
                        slot % pack_size];
    }
    S& at(std::size_t slot, int component) {
        return numbers_[(slot / pack_size * std::size_t(components_) + std::size_t(component)) * pack_size +
                        slot % pack_size];
    }
    /// Slots, a multiple of pack_size; new ones are zero.
    void resize(std::size_t slots) { numbers_.resize(slots * std::size_t(components_)); }

    /// The field in the order of a partition, through `scratch`, which takes the old memory. Padding: zeros.
    template <class Loop>
    void permute(const std::vector<std::uint32_t>& order, aligned_vector<S>& scratch, const Loop& loop) {
        scratch.resize(order.size() * std::size_t(components_));
        loop(order.size() / pack_size, [&](std::size_t pack) {
            S* to = scratch.data() + pack * std::size_t(components_ * pack_size);
            const std::uint32_t* from = order.data() + pack * pack_size;
            for (int c = 0; c < components_; ++c)
                for (int l = 0; l < pack_size; ++l)
                    to[c * pack_size + l] = from[l] == no_particle ? S(0) : get(from[l], c);
        });
        numbers_.swap(scratch);
    }

private:
    int components_ = 1;
    aligned_vector<S> numbers_;
};

/// What the material's state, the transfers and the grid need of every particle.
/// Bytes a particle in float, 3D, elastic: x 12, v 12, C 36, τ 24, F 36, m 4, V0 4, id 4 = 132 (and padding, 1–3 %);
/// sorting adds 12 and one field's worth of scratch, 36.
template <std::floating_point S, int D, class State = ElasticState<S, D>>
class Particles {
public:
    using View = ParticleView<S, D, BlockedSpan<S>, State>;
    static constexpr std::size_t state_fields = state_field_count<State>;

    Particles() {
        constexpr auto members = State::fields();
        unroll<int(state_fields)>([&](auto f) {
            using Member = std::remove_cvref_t<decltype(std::declval<State>().*(std::get<f>(members).member))>;
            state_[f] = BlockedField<S>(component_count<Member>);
        });
    }

    std::size_t size() const { return size_; }
    std::size_t slots() const { return id_.size(); }

    /// Appends a particle; its id is the number of particles added before. Ends the order by blocks.
    void push_back(const Vec<S, D>& x, const Vec<S, D>& v, S mass, S volume) {
        if (end_ == slots()) resize(std::max<std::size_t>(4 * pack_size, 2 * slots()));
        const std::size_t slot = end_++;
        for (int a = 0; a < D; ++a) {
            position_.at(slot, a) = x[a];
            velocity_.at(slot, a) = v[a];
        }
        mass_.at(slot, 0) = mass;
        volume_.at(slot, 0) = volume;
        State state{};
        set_state(slot, state);
        id_[slot] = std::uint32_t(size_++);
    }

    std::uint32_t id(std::size_t slot) const { return id_[slot]; }
    bool is_particle(std::size_t slot) const { return id_[slot] != no_particle; }
    Vec<S, D> position(std::size_t slot) const { return vector(position_, slot); }
    Vec<S, D> velocity(std::size_t slot) const { return vector(velocity_, slot); }
    Mat<S, D> affine(std::size_t slot) const { return matrix(affine_, slot); }
    S mass(std::size_t slot) const { return mass_.get(slot, 0); }
    S volume(std::size_t slot) const { return volume_.get(slot, 0); }
    /// Kirchhoff stress τ [Pa] of the current state.
    Mat<S, D> stress(std::size_t slot) const {
        Mat<S, D> r{};
        for (int i = 0; i < D; ++i)
            for (int j = 0; j < D; ++j) r(i, j) = stress_.get(slot, symmetric_index<D>(i, j));
        return r;
    }
    State state(std::size_t slot) const {
        State state{};
        constexpr auto members = State::fields();
        unroll<int(state_fields)>([&](auto f) {
            auto& member = state.*(std::get<f>(members).member);
            auto* to = detail::components(member);
            for (int k = 0; k < state_[f].components(); ++k) to[k] = state_[f].get(slot, k);
        });
        return state;
    }

    void set_position(std::size_t slot, const Vec<S, D>& x) { set(position_, slot, x.v); }
    void set_velocity(std::size_t slot, const Vec<S, D>& v) { set(velocity_, slot, v.v); }
    void set_affine(std::size_t slot, const Mat<S, D>& C) { set(affine_, slot, C.m); }
    void set_stress(std::size_t slot, const Mat<S, D>& stress) {
        for (int i = 0; i < D; ++i)
            for (int j = i; j < D; ++j) stress_.at(slot, symmetric_index<D>(i, j)) = stress(i, j);
    }
    void set_state(std::size_t slot, State state) {
        constexpr auto members = State::fields();
        unroll<int(state_fields)>(
            [&](auto f) { set(state_[f], slot, detail::components(state.*(std::get<f>(members).member))); });
    }

    View view() {
        View view{position_.span(), velocity_.span(), affine_.span(), stress_.span(), mass_.span(), volume_.span(), {}};
        for (std::size_t f = 0; f < state_fields; ++f) view.state[f] = state_[f].span();
        return view;
    }

    /// Moves all particles into the order of the partition, whose order then names ids.
    /// \param loop  loop(n, body) calls body(pack) for 0 ≤ pack < n
    template <class Loop>
    void reorder(BlockPartition<D>& partition, const Loop& loop) {
        const std::vector<std::uint32_t>& order = partition.order;
        for (BlockedField<S>* field : {&position_, &velocity_, &affine_, &stress_, &mass_, &volume_})
            field->permute(order, scratch_, loop);
        for (BlockedField<S>& field : state_) field.permute(order, scratch_, loop);
        std::vector<std::uint32_t> ids(order.size());
        loop(order.size() / pack_size, [&](std::size_t pack) {
            for (std::size_t slot = pack * pack_size; slot < (pack + 1) * pack_size; ++slot)
                ids[slot] = order[slot] == no_particle ? no_particle : id_[order[slot]];
        });
        id_.swap(ids);
        partition.order = id_;
        end_ = id_.size();
        for (const BlockRange<D>& range : partition.ranges) {
            const std::size_t padding = range.first_slot + range.particles;
            for (std::size_t slot = padding; slot < range.first_slot + range.packs() * pack_size; ++slot) {
                set_state(slot, State{});                                    // padding: at rest, undeformed, massless,
                set_position(slot, position(slot / pack_size * pack_size));  // beside the first particle of its pack
            }
        }
    }

    std::size_t bytes() const {
        std::size_t numbers = scratch_.capacity();
        for (const BlockedField<S>* field : {&position_, &velocity_, &affine_, &stress_, &mass_, &volume_})
            numbers += slots() * std::size_t(field->components());
        for (const BlockedField<S>& field : state_) numbers += slots() * std::size_t(field.components());
        return numbers * sizeof(S) + id_.capacity() * sizeof(std::uint32_t);
    }

private:
    void resize(std::size_t slots) {
        for (BlockedField<S>* field : {&position_, &velocity_, &affine_, &stress_, &mass_, &volume_})
            field->resize(slots);
        for (BlockedField<S>& field : state_) field.resize(slots);
        id_.resize(slots, no_particle);
    }
    static Vec<S, D> vector(const BlockedField<S>& field, std::size_t slot) {
        Vec<S, D> r{};
        for (int a = 0; a < D; ++a) r[a] = field.get(slot, a);
        return r;
    }
    static Mat<S, D> matrix(const BlockedField<S>& field, std::size_t slot) {
        Mat<S, D> r{};
        for (int k = 0; k < D * D; ++k) r.m[k] = field.get(slot, k);
        return r;
    }
    static void set(BlockedField<S>& field, std::size_t slot, const S* numbers) {
        for (int k = 0; k < field.components(); ++k) field.at(slot, k) = numbers[k];
    }

    std::size_t size_ = 0;  ///< particles
    std::size_t end_ = 0;   ///< slots in use, padding included
    BlockedField<S> position_{D}, velocity_{D}, affine_{D * D}, stress_{symmetric_size<D>}, mass_{1}, volume_{1};
    std::array<BlockedField<S>, state_fields> state_;
    std::vector<std::uint32_t> id_;
    aligned_vector<S> scratch_;
};

}  // namespace firn
