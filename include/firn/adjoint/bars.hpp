/// \file The adjoints of the particles of a set.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/field_memory.hpp>
#include <firn/data/particle_store.hpp>

#include <algorithm>
#include <optional>

namespace firn::inline FIRN_BUILD::detail {

/// The adjoints of the particles of a set: one number for each of theirs, in the same layout; and room for records.
template <std::floating_point S, int D>
class ParticleAdjoints {
public:
    aligned_vector<S> records, records_before, of_averages;  ///< Room for what G2PBack writes.

    /// Brings the adjoints into the order of the particles. The first time, all are 0. A particle that had no adjoints
    /// gets 0, and those of a particle that is not in the order are forgotten.
    /// \param table    the fields of the particles
    /// \param order    the id of the particle in each slot
    /// \param next_id  all ids in the order are below
    void follow(const FieldTable& table, const aligned_vector<std::uint32_t>& order, std::uint32_t next_id,
                int threads) {
        if (fields_ && std::ranges::equal(order, ids_)) return;
        if (ids_.empty()) fields_.reset();
        next_id_ = std::max(next_id, next_id_);
        if (fields_) {
            from_.resize(order.size()), slot_of_.resize(next_id_, no_particle);
            for_chunks(ids_.size(), threads, [&](std::size_t first, std::size_t last) {
                for (std::size_t slot = first; slot < last; ++slot)
                    if (ids_[slot] != no_particle) slot_of_[ids_[slot]] = std::uint32_t(slot);
            });
            for_chunks(order.size(), threads, [&](std::size_t first, std::size_t last) {
                for (std::size_t slot = first; slot < last; ++slot)
                    from_[slot] = order[slot] == no_particle ? no_particle
                                  : had(order[slot])         ? slot_of_[order[slot]]
                                                             : 0;
            });
            fields_->template permute<std::conditional_t<sizeof(S) == 4, std::uint32_t, std::uint64_t>>(from_, threads);
            for (std::size_t slot = 0; slot < order.size(); ++slot)
                if (order[slot] == no_particle || !had(order[slot])) clear(table.size(), slot);
        } else {
            fields_.emplace(table, D, sizeof(S), SlotOrder::sorted);
            if (!order.empty()) fields_->grow(order.size(), threads);
        }
        ids_ = order;
    }
    /// Forgets all adjoints.
    void forget() { fields_.reset(), ids_.clear(), next_id_ = 0; }

    /// Returns the ids of the particles in all slots.
    const aligned_vector<std::uint32_t>& ids() const { return ids_; }
    /// Returns the arrays of the adjoints. \tparam View  the type of the particles' arrays
    template <class View>
    View view() {
        View view{};
        constexpr auto built_in = View::built_in();
        for (std::size_t f = 0; f < built_in.size(); ++f) view.*(built_in[f].member) = span(f);
        for (std::size_t f = 0; f < view.state.size(); ++f) view.state[f] = span(built_in.size() + f);
        return view;
    }

private:
    BlockedSpan<S> span(std::size_t field) { return {fields_->template numbers<S>(field), fields_->components(field)}; }
    /// Returns whether a particle has adjoints: slot_of_ may have an old slot of one that has none.
    bool had(std::uint32_t id) const { return slot_of_[id] < ids_.size() && ids_[slot_of_[id]] == id; }
    void clear(std::size_t fields, std::size_t slot) {
        for (std::size_t f = 0; f < fields; ++f)
            for (int k = 0; k < fields_->components(f); ++k) fields_->template at<S>(f, slot, k) = 0;
    }

    std::optional<FieldMemory> fields_;
    aligned_vector<std::uint32_t> ids_, from_, slot_of_;
    std::uint32_t next_id_ = 0;
};

}  // namespace firn::inline FIRN_BUILD::detail
