/// \file Reads a state on many ranks: each rank reads a part of the particles.
#pragma once

#include <firn/data/curve.hpp>
#include <firn/io/state_reader-inl.hpp>
#include <firn/mpi/state_writer.hpp>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi {

namespace detail {

/// Returns the digest of a state of which each rank has read a part. Collective.
template <class S>
std::uint64_t digest_of_parts(const Communicator& all, const firn::detail::StateOnDisk<S>& found) {
    const State<S>& state = found.state;
    firn::detail::StateOutline whole(state);
    HashChain chain(all);
    const auto spread = [&](firn::detail::StateArray& array, std::uint64_t rows, int columns) {
        chain.add(array);
        array.move_elsewhere(std::size_t(rows) * std::size_t(columns));
    };
    const auto for_arrays = [&](const auto& f) {
        f(whole.id, found.points, 1);
        f(whole.body, found.points, 1);
        for (auto& field : whole.fields) f(field.values, found.points, field.components);
        for (std::size_t t = 0; t < whole.tables.size(); ++t)
            if (firn::detail::is_spread_table(whole.tables[t].name))
                f(whole.tables[t].values, found.table_rows[t], whole.tables[t].columns);
    };
    for_arrays(spread);
    const std::vector<std::uint64_t> hashes = chain.whole();
    auto next = hashes.begin();
    for_arrays([&](auto& array, std::uint64_t, int) { array.hash = *next++; });
    return firn::detail::digest_of(whole, [](std::string_view) { return true; });
}

inline StateTable* find_table(std::vector<StateTable>& tables, std::string_view name, int columns) {
    for (StateTable& table : tables)
        if (table.name == name && table.columns == columns) return &table;
    return nullptr;
}

/// A block of a state's table of blocks: its coordinates, its first slot, and the number of its particles.
template <int D>
struct BlockRow {
    BlockCoordinate<D> block;
    std::int64_t first, count;
};

template <int D>
std::vector<BlockRow<D>> block_rows(const StateTable& blocks) {
    std::vector<BlockRow<D>> rows;
    for (std::size_t at = 0; at + D + 2 <= blocks.values.size(); at += D + 2) {
        BlockRow<D> row{{}, blocks.values[at + D], blocks.values[at + D + 1]};
        for (std::size_t a = 0; a < std::size_t(D); ++a) {
            // A damaged coordinate becomes one that no block has; restore() refuses it.
            row.block[a] = int(std::clamp<std::int64_t>(blocks.values[at + a], -(1 << 20), (1 << 20) - 1));
        }
        rows.push_back(row);
    }
    return rows;
}

/// Renumbers the slots of a state that an earlier version wrote, in which the blocks are in the order of their keys and
/// slots have gaps, so that the blocks follow the curve. The table of blocks of such a state, which one process has
/// written, is gathered on every rank. Does nothing if the blocks follow the curve. Collective.
template <int D, class S>
void number_on_curve(const Communicator& all, State<S>& part) {
    StateTable* const slots = find_table(part.tables, "slot", 1);
    StateTable* const blocks = find_table(part.tables, "blocks", D + 2);
    if (!slots || !blocks) return;  // the file's tables are the same on all ranks
    struct Ends {
        bool has, follows;
        BlockCoordinate<D> first, last;
        std::int64_t first_slot, end;
    };
    const auto follows = [](const auto& row, const auto& next) {
        return before_on_curve<D>(row.block, next.block) && row.first + row.count == next.first;
    };
    std::vector<BlockRow<D>> rows = block_rows<D>(*blocks);
    Ends mine{!rows.empty(), true, {}, {}, 0, 0};
    if (mine.has) {
        mine = {true,
                true,
                rows.front().block,
                rows.back().block,
                rows.front().first,
                rows.back().first + rows.back().count};
        for (std::size_t i = 1; i < rows.size(); ++i) mine.follows = mine.follows && follows(rows[i - 1], rows[i]);
    }
    bool all_follow = true, has_before = false;
    Ends before{};
    for (const Ends& ends : all.all(mine)) {
        if (!ends.has) continue;
        all_follow = all_follow && ends.follows &&
                     (has_before ? before_on_curve<D>(before.last, ends.first) && before.end == ends.first_slot
                                 : ends.first_slot == 0);
        before = ends;
        has_before = true;
    }
    if (all_follow) return;

    std::vector<Message> copies;
    for (int rank = 0; rank < all.size(); ++rank) {
        const auto bytes = std::as_bytes(std::span(blocks->values));
        copies.push_back({rank, {bytes.begin(), bytes.end()}});
    }
    StateTable whole{"blocks", D + 2, {}};
    for (const Message& message : exchange(all, std::move(copies))) {
        const std::size_t at = whole.values.size();
        whole.values.resize(at + message.bytes.size() / sizeof(std::int64_t));
        std::copy_n(message.bytes.data(), message.bytes.size(), reinterpret_cast<std::byte*>(whole.values.data() + at));
    }
    rows = block_rows<D>(whole);
    std::ranges::sort(rows, [](const auto& a, const auto& b) { return before_on_curve<D>(a.block, b.block); });
    std::vector<std::uint32_t> by_slot(rows.size());
    std::iota(by_slot.begin(), by_slot.end(), std::uint32_t(0));
    std::ranges::sort(by_slot, {}, [&](std::uint32_t b) { return rows[b].first; });
    std::vector<std::int64_t> first_on_curve(rows.size() + 1);
    for (std::size_t b = 0; b < rows.size(); ++b) first_on_curve[b + 1] = first_on_curve[b] + rows[b].count;
    for (std::int64_t& slot : slots->values) {
        const auto after = std::ranges::upper_bound(by_slot, slot, {}, [&](std::uint32_t b) { return rows[b].first; });
        if (after == by_slot.begin()) {
            slot = -1;  // no block has this slot: restore() refuses it
            continue;
        }
        const std::uint32_t b = *(after - 1);
        slot = slot - rows[b].first < rows[b].count ? first_on_curve[b] + (slot - rows[b].first) : -1;
    }
    const RowsPart share{std::uint64_t(all.rank()), std::uint64_t(all.size())};
    blocks->values.clear();
    const std::uint64_t first = share.first(rows.size());
    for (std::uint64_t b = first; b < first + share.count(rows.size()); ++b) {
        for (const int coordinate : rows[b].block) blocks->values.push_back(coordinate);
        blocks->values.push_back(first_on_curve[b]);
        blocks->values.push_back(rows[b].count);
    }
}

}  // namespace detail

/// Reads a state from an HDF5 file on many ranks: each rank gets a part of the particles, consecutive in the file and
/// equally many on each rank, and a part of the table `blocks`. Everything else is the same on all ranks. The digest is
/// computed by all ranks together. \see restore
///
/// The file may have been written without MPI, or on any number of ranks. If a file of schema_version 1 to 3 is read,
/// slots are renumbered along the curve, for which each rank needs memory for the whole table of blocks.
/// \tparam S  precision of the state in the file, float or double
/// \param all      the ranks
/// \param path     the name of the file; each rank opens the file
/// \param reading  options, as for firn::read_state()
/// \throws io_error  as firn::read_state(), and if the state has facets. All ranks throw the same error.
template <state_scalar S>
State<S> read_state(const Communicator& all, const std::filesystem::path& path, const StateReading& reading = {}) {
    auto found = detail::together(all, [&] {
        const detail::RowsPart part{std::uint64_t(all.rank()), std::uint64_t(all.size())};
        auto read =
            hdf5::naming_file(path, [&] { return firn::detail::read_state_file<S>(path, reading.verify, part); });
        firn::detail::check_what_was_read(path, read.state);
        return read;
    });
    if (found.digest) {
        const std::uint64_t digest = detail::digest_of_parts(all, found);
        detail::together(all, [&] {
            if (digest != *found.digest) firn::detail::throw_wrong_digest(path);
        });
    }
    if (all.size() > 1) {
        if (found.state.dimension == 2)
            detail::number_on_curve<2>(all, found.state);
        else
            detail::number_on_curve<3>(all, found.state);
    }
    return std::move(found.state);
}

}  // namespace firn::inline FIRN_BUILD::mpi
