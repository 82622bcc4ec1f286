/// \file Bodies of particle_store.hpp. A program that links firn::compiled does not include them.
#pragma once

#include <firn/data/particle_store.hpp>

namespace firn::inline FIRN_BUILD {

template <std::floating_point S, int D>
std::size_t ParticleStore<S, D>::push_back(const Vec<double, D>& x) {
    ids_.require(1);
    const std::size_t slot = new_slot();
    set_start(slot);
    set_position(slot, x, 0);
    id_[slot] = ids_.give();
    ++size_;
    return slot;
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::remove(std::size_t slot) {
    if (!is_particle(slot)) return;
    id_[slot] = no_particle;
    set_start(slot);
    --size_;
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::get(std::size_t field, std::size_t slot, S* to) const {
    const FieldInfo& info = table_[field];
    for (int k = 0; k < info.components_in_state(D); ++k) {
        const S stored = fields_.template at<S>(field, slot, info.component_of(D, k));
        to[k] = info.is_less_one(D, k) ? S(1) + stored : stored;
    }
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::get_remainders(std::size_t field, std::size_t slot, S* to) const {
    const FieldInfo& info = table_[field];
    for (int k = 0; k < info.components_in_state(D); ++k) {
        if (!info.is_less_one(D, k)) continue;
        const S stored = fields_.template at<S>(field, slot, info.component_of(D, k));
        *to++ = stored - ((S(1) + stored) - S(1));
    }
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::set_position(std::size_t slot, const Vec<double, D>& x, int group) {
    BlockCoordinate<D> of{};
    Vec<S, D> place{};
    for (int a = 0; a < D; ++a) {
        const double cells = (snapped_to_faces<S>(domain_, a, x[a]) - domain_.lower[a]) / domain_.cell_size;
        const double block = std::floor(cells / block_size);
        of[std::size_t(a)] = std::abs(block) < most_blocks_per_axis ? int(block) : 0;  // NaN: block 0
        if (a == 0 && !domain_.periodic[0])  // outside of the domain lie the copies of its blocks
            of[0] = std::clamp(of[0], -1, blocks_for(domain_.cells(0)));
        place[a] = S(cells - block_size * double(of[std::size_t(a)]));
    }
    of = wrapped(domain_, of);
    of[0] += group * copy_stride(domain_);
    set_place(slot, of, place);
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::write_record(std::size_t slot, std::byte* to) const {
    const auto put = [&](const auto& value) {
        std::memcpy(to, &value, sizeof value);
        to += sizeof value;
    };
    put(blocks_[block_[slot]]);
    put(id_[slot]);
    for (std::size_t f = 0; f < table_.size(); ++f)
        for (int k = 0; k < fields_.components(f); ++k) put(fields_.template at<S>(f, slot, k));
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::put_record(std::size_t slot, const std::byte* from) {
    const auto take = [&](auto value) {
        std::memcpy(&value, from, sizeof value);
        from += sizeof value;
        return value;
    };
    end_ = std::max(end_, slot + 1);
    const std::uint64_t block = take(std::uint64_t(0));
    id_[slot] = take(std::uint32_t(0));
    for (std::size_t f = 0; f < table_.size(); ++f)
        for (int k = 0; k < fields_.components(f); ++k) fields_.template at<S>(f, slot, k) = take(S(0));
    set_block(slot, block);
    ids_.skip(id_[slot] + 1);
    ++size_;
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::reorder(BlockPartition<D>& partition, int workers) {
    aligned_vector<std::uint32_t>& order = partition.order;
    const auto for_groups = [&](const auto& body) {
        parallel_for(partition.groups.size(), workers, [&](std::size_t g, int) { body(partition.groups[g]); }, 64);
    };
    fields_.template permute<std::conditional_t<sizeof(S) == 4, std::uint32_t, std::uint64_t>>(order, workers, spare_);

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
    const std::size_t all_slots = order.size() + spare_;
    for (aligned_vector<std::uint32_t>* of_slots : {&id_, &block_}) {
        of_slots->clear();
        if (of_slots->capacity() < all_slots) of_slots->reserve(all_slots + all_slots / 64);
        of_slots->resize(all_slots);
    }
    std::fill_n(id_.data() + order.size(), spare_, no_particle);
    std::fill_n(block_.data() + order.size(), spare_, 0u);
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

template <std::floating_point S, int D>
typename ParticleStore<S, D>::BuiltIn ParticleStore<S, D>::motion() {
    BuiltIn view{};
    constexpr auto built_in = BuiltIn::built_in();
    for (std::size_t f = 0; f < built_in.size(); ++f) view.*(built_in[f].member) = span(f);
    return view;
}

template <std::floating_point S, int D>
std::size_t ParticleStore<S, D>::new_slot() {
    if (end_ == slots()) {
        const std::size_t more = std::max<std::size_t>(4 * pack_size, slots() + slots() / 2 / pack_size * pack_size);
        grow(more, more, 0);
    }
    return end_++;
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::set_block(std::size_t slot, std::uint64_t key) {
    if (blocks_.empty() || blocks_.back() != key) {
        blocks_.push_back(key);
        grouped_ = grouped_ || group_of_copy(block_of_key<D>(key)[0], copy_stride(domain_)) != 0;
    }
    block_[slot] = std::uint32_t(blocks_.size() - 1);
}

template <std::floating_point S, int D>
void ParticleStore<S, D>::grow(std::size_t slots, std::size_t particles, int threads) {
    require_memory(
        double(fields_.bytes()) + double(fields_.bytes_for(slots)) + double(slots) * 2 * sizeof(std::uint32_t),
        sentence("Room for ", particles, " particles"), "Take fewer: choose a larger spacing or a smaller body.");
    const int workers = thread_count(threads);
    parallel_region(workers, [&] {
        fields_.grow(slots, workers);
        firn::grow(id_, slots, no_particle, workers);
        firn::grow(block_, slots, {}, workers);
    });
}

template <std::floating_point S, int D>
Mat<S, D> ParticleStore<S, D>::matrix(std::size_t field, std::size_t slot) const {
    Mat<S, D> r{};
    for (int k = 0; k < D * D; ++k)
        r(k / D, k % D) = fields_.template at<S>(field, slot, table_[field].component_of(D, k));
    return r;
}

}  // namespace firn::inline FIRN_BUILD
