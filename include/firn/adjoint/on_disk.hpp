/// \file States of a simulation on disk: the arrays of the particles, which are nearly all of a state.
///
/// What is not an array of numbers, such as the functions of loads, stays in memory.
#pragma once

#include <firn/data/scratch_file.hpp>
#include <firn/simulation/set_of.hpp>

#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace firn::inline FIRN_BUILD::detail {

/// An array of a state.
struct ArrayOfState {
    void* array;
    std::size_t size;              // number of entries
    std::span<std::byte> numbers;  // those that the state needs

    void (*resize)(void* array, std::size_t size);  // the entries are lost; with 0, so is the memory
    void (*exchange)(void* array, void* other);     // with another of the same type
};

template <class Array>
ArrayOfState array_of_state(Array& list, std::size_t first, std::size_t count) {
    using Number = typename Array::value_type;
    static_assert(std::is_trivially_copyable_v<Number>);
    return {&list, list.size(), std::as_writable_bytes(std::span<Number>(list.data() + first, count)),
            [](void* of, std::size_t size) {
                Array& array = *static_cast<Array*>(of);
                if (size == 0) return Array().swap(array);
                array.clear();
                array.resize(size);
            },
            [](void* of, void* other) { static_cast<Array*>(of)->swap(*static_cast<Array*>(other)); }};
}

/// Adds the arrays of a set of particles to a list; for sets of one simulation always in the same order.
template <std::floating_point S, int D>
void add_arrays(SetOf<S, D>& set, std::vector<ArrayOfState>& to) {
    const auto add = [&](auto& array, std::size_t first, std::size_t count) {
        to.push_back(array_of_state(array, first, count));
    };
    const auto add_whole = [&](auto&... array) { (add(array, 0, array.size()), ...); };
    set.store().for_arrays(add);
    BlockPartition<D>& partition = set.partition;
    add_whole(partition.ranges, partition.groups, partition.by_block, partition.by_phase, partition.phase_ends,
              partition.order);
    add_whole(set.bodies, set.sinks, set.facets, set.places_before);
    for (Source<D>& source : set.sources) add_whole(source.samples.positions);
}

/// Puts the sets of states on disk, and brings them back.
template <std::floating_point S, int D>
class StatesOnDisk {
public:
    /// The sets of a state.
    using Sets = std::vector<std::unique_ptr<SetOf<S, D>>>;
    /// Where the arrays of a state lie that is on disk.
    struct Place {
        ScratchFile::Record record;
        std::vector<std::size_t> sizes;  // numbers of entries
    };

    /// \param folder  folder in which the file lies
    /// \param bytes   how many bytes it may have
    /// \param sets    those of the simulation
    /// \throws io_error  if the folder has no room for a file
    StatesOnDisk(const std::string& folder, std::size_t bytes, const SetList<S, D>& sets) : file_(folder, bytes) {
        for (const SetOf<S, D>& set : sets) {
            auto& without = *without_arrays_.emplace_back(set.copy());
            without.store() = ParticleStore<S, D>(set.store().domain(), set.store().table());
        }
        clear(arrays(without_arrays_));
    }

    /// Returns how many states as large as the present one have room. One more has room, so that states can be
    /// exchanged.
    std::size_t most(SetList<S, D>& sets) const {
        const std::size_t pages = pages_of(sets), fit = file_.most_pages() / std::max<std::size_t>(pages, 1);
        return fit - std::size_t(fit > 0);
    }
    /// Returns how many bytes two states take on disk that are as large as the present one.
    std::size_t least_bytes(SetList<S, D>& sets) const { return 2 * pages_of(sets) * ScratchFile::page_bytes; }
    /// Returns about how many bytes stay in memory of a state that is on disk.
    std::size_t bytes_in_memory(SetList<S, D>& sets) const {
        std::size_t bytes = pages_of(sets) * sizeof(std::uint32_t) + sizeof(Place) + 64;
        for (SetOf<S, D>& set : sets)
            bytes += sizeof(set) + sizeof(ParticleStore<S, D>) + set.store().table().size() * sizeof(FieldInfo) +
                     set.sources.size() * sizeof(Source<D>) + (16 + set.sources.size()) * sizeof(std::size_t);
        return bytes;
    }

    /// Writes the arrays of a state to disk, and gives them to `memory`. Returns false, and changes nothing, if there
    /// is no room.
    /// \throws io_error  if writing fails; nothing is changed
    [[gnu::cold]] bool put(Sets& state, Place& place, Sets& memory) {
        const std::vector<ArrayOfState> from = arrays(state);
        std::vector<std::span<const std::byte>> parts;
        Place there;
        for (const ArrayOfState& one : from) parts.push_back(one.numbers), there.sizes.push_back(one.size);
        auto record = file_.write(parts);
        if (!record) return false;
        make_like(memory);
        exchange(from, arrays(memory));
        there.record = std::move(*record);
        place = std::move(there);
        return true;
    }
    /// Brings the arrays of a state back, into those of `memory`.
    /// \throws io_error  if reading fails, or the bytes are not those that were written; the state is still on disk
    [[gnu::cold]] void bring(Sets& state, Place& place, Sets& memory) {
        make_like(memory);
        std::vector<ArrayOfState> to = arrays(state);
        exchange(to, arrays(memory));
        try {
            for (std::size_t k = 0; k < to.size(); ++k) to[k].resize(to[k].array, place.sizes[k]);
            std::vector<std::span<std::byte>> parts;
            for (const ArrayOfState& one : arrays(state)) parts.push_back(one.numbers);
            file_.read(place.record, parts);
        } catch (...) {
            clear(to);
            throw;
        }
        place = {};
    }

private:
    static std::vector<ArrayOfState> arrays(Sets& sets) {
        std::vector<ArrayOfState> all;
        for (const auto& set : sets) add_arrays(*set, all);
        return all;
    }
    static void exchange(const std::vector<ArrayOfState>& these, const std::vector<ArrayOfState>& others) {
        for (std::size_t k = 0; k < these.size(); ++k) these[k].exchange(these[k].array, others[k].array);
    }
    /// Frees the memory of arrays.
    static void clear(const std::vector<ArrayOfState>& arrays) {
        for (const ArrayOfState& one : arrays) one.resize(one.array, 0);
    }
    /// Makes sets for arrays, if there are none.
    void make_like(Sets& sets) const {
        sets.resize(without_arrays_.size());
        for (std::size_t k = 0; k < sets.size(); ++k)
            if (!sets[k]) sets[k] = without_arrays_[k]->copy();
    }
    /// Returns how many pages the present state needs, with a sixteenth more, because matter may spread.
    static std::size_t pages_of(SetList<S, D>& sets) {
        std::vector<ArrayOfState> all;
        for (SetOf<S, D>& set : sets) add_arrays(set, all);
        std::size_t bytes = 0;
        for (const ArrayOfState& one : all) bytes += one.numbers.size();
        return ScratchFile::pages_for(bytes + bytes / 16);
    }

    ScratchFile file_;
    Sets without_arrays_;  // sets as those of the simulation
};

/// Makes what puts states on disk; none if no folder is given.
/// \throws parameter_error  if a folder is given without room for two states, or room without a folder
/// \throws io_error         if no file can be made in the folder
template <std::floating_point S, int D>
[[gnu::cold]] std::unique_ptr<StatesOnDisk<S, D>> states_on_disk(const std::string& folder, std::size_t bytes,
                                                                 SetList<S, D>& sets) {
    if (folder.empty() && bytes > 0)
        throw parameter_error(
            sentence("An adjoint may use ", bytes, " bytes on disk, but there is no folder: give one."));
    if (folder.empty()) return {};
    auto made = std::make_unique<StatesOnDisk<S, D>>(folder, bytes, sets);
    if (made->most(sets) == 0)
        throw parameter_error(sentence("An adjoint may use ", bytes, " bytes in the folder \"", folder, "\". Give it ",
                                       made->least_bytes(sets), " at least, the room of two states, or no folder."));
    return made;
}

}  // namespace firn::inline FIRN_BUILD::detail
