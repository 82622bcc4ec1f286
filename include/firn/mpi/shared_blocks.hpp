/// \file The blocks of nodes that several ranks share, and the pieces of their sums that each rank adds.
///
/// The sum at a node must be formed in the same order on any number of ranks. So a rank does not add up its own
/// contributions first. It keeps one *piece* for each shared block and turn: the contributions of its groups that come
/// in this turn. One rank, the summing rank of the block, adds the pieces of all ranks in the order of turns, which is
/// the order in which one process would add them. Two groups of the same turn may contribute to one block, but never to
/// one node.
#pragma once

#include <firn/data/sparse_grid.hpp>
#include <firn/mpi/communicator.hpp>
#include <firn/mpi/cuts.hpp>

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi::detail {

/// A piece: the contributions of one rank to a block, of all groups that come in one turn.
struct Piece {
    std::uint32_t block;  ///< index of the block in this rank's grid
    std::uint32_t turn;   ///< place in the order of additions
};

/// Whether a summing rank adds its own pieces before all others, instead of in the order of turns. The bits then depend
/// on the number of ranks. Tests set this to true, to see that they would notice.
inline bool adds_own_first = false;

/// The rank that sums a block: the owner of its cube if it has the block, else the lowest of the ranks that have it.
class SummingRank {
public:
    /// \param owner  the owner of the block's cube
    explicit SummingRank(int owner) : owner_(owner) {}
    /// Tells that a rank has the block in its grid.
    void add(int holder) { rank_ = holder == owner_ || rank_ == owner_ ? owner_ : std::min(rank_, holder); }
    int rank() const { return rank_; }  ///< Returns the rank that sums the block.

private:
    int owner_, rank_ = std::numeric_limits<int>::max();
};

/// Pieces that travel in one message, or that stay on this rank.
struct PieceMessage {
    int rank;                     ///< the rank that receives the pieces, or that has sent them
    int batch;                    ///< 0: sent while the rest is scattered; 1: sent at the end
    std::vector<Piece> pieces{};  ///< the pieces, in the order of the message
    std::size_t first = 0;        ///< index of the first piece among all pieces of this rank, if it sends them
};

/// Which pieces of which messages belong to a block.
struct PieceOfMessage {
    std::uint32_t message, piece;
};

/// A list of lists.
template <class T>
struct Lists {
    std::vector<std::size_t> ends{};
    std::vector<T> items{};

    std::size_t size() const { return ends.size(); }
    std::span<const T> operator[](std::size_t i) const {
        const std::size_t first = i == 0 ? 0 : ends[i - 1];
        return std::span(items).subspan(first, ends[i] - first);
    }
    void close() { ends.push_back(items.size()); }
};

/// The sums of a summing rank that travel to one contributor, or back from one summing rank.
struct ReturnedBlocks {
    int rank;
    std::vector<std::uint32_t> blocks{};  ///< indices of the blocks in this rank's grid, ascending
    Lists<PieceOfMessage> pieces{};       ///< for each block, the contributor's pieces
    std::vector<std::uint64_t> masks{};   ///< for each block, the nodes that travel; set anew in every step
};

/// The blocks that this rank shares with others, since the last sort.
template <int D>
class SharedBlocks {
public:
    static constexpr std::uint32_t none = 0xffffffffu;

    /// Finds the shared blocks, their summing ranks and the pieces. Collective.
    /// \param grid        the grid, activated for the partitions
    /// \param partitions  for each material, the groups of this rank
    /// \param cuts        for each material, which rank owns which cubes
    /// \param colours     number of colours of dense blocks along an axis. \see colours_along_axis
    /// \param by_turn     false: sums are in integers, which need no order; a block then has one piece, in the grid
    template <std::floating_point S>
    SharedBlocks(const Communicator& all, const SparseGrid<S, D>& grid,
                 std::span<const BlockPartition<D>* const> partitions, std::span<const Cuts<D>> cuts, int colours,
                 bool by_turn)
        : me_(all.rank()), block_count_(grid.block_count()), by_turn_(by_turn) {
        turns_ = std::uint32_t(block_colours(colours) + (1u << D));
        for (const BlockPartition<D>* partition : partitions) rows_ += partition->ranges.size();
        boundary_groups_.resize(partitions.size());
        phases_of_batch_.resize(partitions.size(), 0);
        find_contributors(all, grid, cuts);
        if (all.size() > 1) {
            find_pieces(grid, partitions, colours);
            exchange_pieces(all, grid);
        }
    }
    SharedBlocks() = default;

    std::size_t block_count() const { return block_count_; }  ///< Number of blocks of the grid.
    /// Number of pieces that lie behind the blocks of the grid.
    std::size_t blocks_behind() const { return by_turn_ ? pieces_.size() : 0; }
    std::span<const Piece> pieces() const { return pieces_; }  ///< The pieces of this rank.
    /// The index of the block that holds the sums of piece i: behind the grid, or, for integers, in the grid.
    std::size_t storage(std::size_t i) const { return by_turn_ ? block_count_ + i : pieces_[i].block; }
    /// The piece whose sums lie in the block with this index; `none` if it holds no piece.
    std::uint32_t piece_in(std::uint32_t block) const {
        if (by_turn_) return block < block_count_ ? none : std::uint32_t(block - block_count_);
        return piece_of_block_.empty() ? none : piece_of_block_[block];
    }
    /// The grid's blocks to which a range scatters: like SparseGrid::neighbours, but with pieces for shared blocks.
    const std::uint32_t* neighbours(std::size_t row) const { return table_.data() + row * around; }
    bool has_table() const { return !table_.empty(); }  ///< Whether some groups scatter to pieces.
    /// Indices of the groups of a material that contribute to shared blocks.
    const std::vector<std::uint32_t>& boundary_groups(std::size_t material) const { return boundary_groups_[material]; }
    /// The number of phases of a material after which the pieces of batch 0 are complete.
    std::size_t phases_of_batch(std::size_t material) const { return phases_of_batch_[material]; }

    /// Whether this rank counts a block in sums over all blocks: every block is counted by one rank.
    bool counts(std::size_t block) const { return summing_rank_.empty() || summing_rank_[block] == me_; }

    const std::vector<PieceMessage>& outgoing() const { return outgoing_; }  ///< Messages of pieces to other ranks.
    const std::vector<PieceMessage>& incoming() const { return incoming_; }  ///< Messages of pieces from other ranks.
    /// The message number that stands for this rank's own pieces in sums().
    std::uint32_t own() const { return std::uint32_t(incoming_.size()); }
    /// The blocks that this rank sums.
    const std::vector<std::uint32_t>& summed_blocks() const { return summed_; }
    /// For each block that this rank sums: its pieces, in the order of additions.
    const Lists<PieceOfMessage>& sums() const { return sums_; }
    std::vector<ReturnedBlocks>& to_return() { return to_return_; }  ///< Sums that this rank sends back.
    std::vector<ReturnedBlocks>& to_get() { return to_get_; }        ///< Sums that come back to this rank.

private:
    static constexpr int around = SparseGrid<float, D>::neighbour_count;

    static unsigned block_colours(int along_axis) {
        unsigned colours = 1;
        for (int a = 0; a < D; ++a) colours *= unsigned(along_axis);
        return colours;
    }
    static std::uint32_t turn_of(const BlockGroup& group, BlockCoordinate<D> block, int colours) {
        if (!group.sparse) return std::uint32_t(block_colour<D>(block, colours));
        std::uint32_t parity = 0;
        for (const int coordinate : cube_of<D>(block)) parity = parity << 1 | std::uint32_t(coordinate & 1);
        return block_colours(colours) + parity;
    }

    /// Finds, for each block of the grid, which other ranks have it in their grids. A rank has a block in its grid if
    /// it has particles in one of the blocks around it.
    template <class S>
    void find_contributors(const Communicator& all, const SparseGrid<S, D>& grid, std::span<const Cuts<D>> cuts) {
        if (all.size() == 1) return;
        summing_rank_.assign(block_count_, me_);
        std::vector<int> seen;
        std::vector<std::pair<int, std::uint32_t>> candidates;
        for (std::uint32_t b = 0; b < block_count_; ++b) {
            // The blocks around a block lie in 2^D cubes, those of its outermost corners.
            seen.clear();
            for (int corner = 0; corner < 1 << D; ++corner) {
                BlockCoordinate<D> block = grid.block(b);
                for (int a = 0; a < D; ++a) block[std::size_t(a)] += (corner >> a & 1) ? 1 : -1;
                const std::uint64_t cube = curve_key<D>(cube_of<D>(wrapped(grid.domain(), block)));
                for (std::size_t m = 0; m < cuts.size(); ++m) {
                    if (m > 0 && cuts[m] == cuts[m - 1]) continue;
                    const int rank = cuts[m].owner_of_key(cube);
                    if (rank != me_ && std::find(seen.begin(), seen.end(), rank) == seen.end()) seen.push_back(rank);
                }
            }
            for (const int rank : seen) candidates.emplace_back(rank, b);
        }
        std::sort(candidates.begin(), candidates.end());
        std::vector<Message> outgoing;
        for (const auto& [rank, b] : candidates) {
            if (outgoing.empty() || outgoing.back().rank != rank) outgoing.push_back({rank, {}});
            append(outgoing.back().bytes, block_key<D>(grid.block(b)));
        }
        std::vector<std::pair<std::uint32_t, int>> contributors;  // (block, rank)
        for (const Message& message : exchange(all, std::move(outgoing)))
            for (std::size_t at = 0; at < message.bytes.size(); at += sizeof(std::uint64_t)) {
                const std::uint32_t b = grid.find(block_of_key<D>(read<std::uint64_t>(message.bytes, at)));
                if (b != no_block) contributors.emplace_back(b, message.rank);
            }
        std::sort(contributors.begin(), contributors.end());
        is_shared_.assign(block_count_, false);
        for (std::size_t i = 0; i < contributors.size();) {
            const std::uint32_t b = contributors[i].first;
            is_shared_[b] = true;
            SummingRank summing(cuts[0].owner(grid.block(b)));
            summing.add(me_);
            for (; i < contributors.size() && contributors[i].first == b; ++i) summing.add(contributors[i].second);
            summing_rank_[b] = summing.rank();
        }
    }

    template <class S>
    void find_pieces(const SparseGrid<S, D>& grid, std::span<const BlockPartition<D>* const> partitions, int colours) {
        struct Made {
            int rank, batch;
            std::uint32_t block, turn;
            auto operator<=>(const Made&) const = default;
        };
        const std::uint32_t split = by_turn_ ? split_turn(partitions, colours) : 0;
        std::vector<Made> made;
        const auto for_contributions = [&](const auto& body) {  // body(row, k, block, turn) for shared blocks
            for (std::size_t m = 0; m < partitions.size(); ++m) {
                const BlockPartition<D>& partition = *partitions[m];
                for (std::uint32_t g = 0; g < partition.groups.size(); ++g) {
                    const BlockGroup& group = partition.groups[g];
                    const std::uint32_t turn =
                        by_turn_ ? std::uint32_t(m) * turns_ +
                                       turn_of(group, partition.ranges[group.first_range].block, colours)
                                 : 0;
                    for (std::uint32_t r = group.first_range; r < group.first_range + group.ranges; ++r) {
                        const std::uint32_t* const near = grid.neighbours(partition, r);
                        for (int k = 0; k < around; ++k)
                            if (is_shared_[near[k]]) body(m, g, partition.first_row + r, k, near[k], turn);
                    }
                }
            }
        };
        for_contributions(
            [&](std::size_t m, std::uint32_t g, std::size_t, int, std::uint32_t block, std::uint32_t turn) {
                auto& groups = boundary_groups_[m];
                if (groups.empty() || groups.back() != g) groups.push_back(g);
                if (!by_turn_ && summing_rank_[block] == me_) return;  // integers are added to the block itself
                made.push_back({summing_rank_[block], turn < split ? 0 : 1, block, turn});
            });
        std::sort(made.begin(), made.end());
        made.erase(std::unique(made.begin(), made.end()), made.end());
        for (const Made& piece : made) {
            if (piece.rank != me_) {
                if (outgoing_.empty() || outgoing_.back().rank != piece.rank || outgoing_.back().batch != piece.batch)
                    outgoing_.push_back({piece.rank, piece.batch, {}, pieces_.size()});
                outgoing_.back().pieces.push_back({piece.block, piece.turn});
            }
            pieces_.push_back({piece.block, piece.turn});
        }
        for (std::size_t i = 0; i < made.size(); ++i)
            if (made[i].rank == me_) own_pieces_.push_back(std::uint32_t(i));
        if (!by_turn_) {
            piece_of_block_.assign(block_count_, none);
            for (std::uint32_t i = 0; i < pieces_.size(); ++i) piece_of_block_[pieces_[i].block] = i;
            return;
        }
        if (boundary_groups_empty()) return;

        // The second table of neighbours.
        std::vector<std::pair<std::uint64_t, std::uint32_t>> places;
        for (std::uint32_t i = 0; i < pieces_.size(); ++i)
            places.emplace_back(std::uint64_t(pieces_[i].block) << 32 | pieces_[i].turn, i);
        std::sort(places.begin(), places.end());
        table_.resize(rows_ * around);
        for (const BlockPartition<D>* partition : partitions)
            std::copy_n(grid.neighbours(*partition, 0), partition->ranges.size() * around,
                        table_.data() + partition->first_row * around);
        for_contributions(
            [&](std::size_t, std::uint32_t, std::size_t row, int k, std::uint32_t block, std::uint32_t turn) {
                const std::pair<std::uint64_t, std::uint32_t> wanted(std::uint64_t(block) << 32 | turn, 0);
                const auto place = std::lower_bound(places.begin(), places.end(), wanted);
                table_[row * around + std::size_t(k)] = std::uint32_t(block_count_ + place->second);
            });
    }
    bool boundary_groups_empty() const {
        return std::all_of(boundary_groups_.begin(), boundary_groups_.end(), [](const auto& g) { return g.empty(); });
    }

    /// Returns the first turn of batch 1: about half of the particles are scattered in the turns before it. Batches end
    /// between two phases.
    std::uint32_t split_turn(std::span<const BlockPartition<D>* const> partitions, int colours) {
        std::size_t whole = 0, sum = 0;
        for (const BlockPartition<D>* partition : partitions) whole += partition->particles;
        std::uint32_t split = 0;
        for (std::size_t m = 0; m < partitions.size(); ++m) {
            const BlockPartition<D>& partition = *partitions[m];
            for (std::size_t phase = 0, first = 0; phase < partition.phase_ends.size(); ++phase) {
                if (2 * sum >= whole) return split;
                std::uint32_t turn = 0;
                bool sparse = false;
                for (std::size_t i = first; i < partition.phase_ends[phase]; ++i) {
                    const BlockGroup& group = partition.groups[partition.by_phase[i]];
                    sum += group.particles;
                    sparse = group.sparse;
                    turn = turn_of(group, partition.ranges[group.first_range].block, colours);
                }
                first = partition.phase_ends[phase];
                // The turns of sparse groups are complete only after the last phase.
                if (sparse && phase + 1 < partition.phase_ends.size()) continue;
                split = std::uint32_t(m) * turns_ + (sparse ? turns_ : turn + 1);
                phases_of_batch_[m] = phase + 1;
            }
        }
        return split;
    }

    template <class S>
    void exchange_pieces(const Communicator& all, const SparseGrid<S, D>& grid) {
        std::vector<Message> outgoing;
        for (const PieceMessage& message : outgoing_) {
            Message& to = outgoing.emplace_back(Message{message.rank, {}});
            append(to.bytes, std::uint64_t(message.batch));
            for (const Piece& piece : message.pieces) {
                append(to.bytes, block_key<D>(grid.block(piece.block)));
                append(to.bytes, std::uint64_t(piece.turn));
            }
        }
        for (const Message& message : exchange(all, std::move(outgoing))) {
            PieceMessage& from =
                incoming_.emplace_back(PieceMessage{message.rank, int(read<std::uint64_t>(message.bytes, 0)), {}, 0});
            for (std::size_t at = 8; at < message.bytes.size(); at += 16)
                from.pieces.push_back({grid.find(block_of_key<D>(read<std::uint64_t>(message.bytes, at))),
                                       std::uint32_t(read<std::uint64_t>(message.bytes, at + 8))});
        }

        struct Source {
            std::uint32_t block, turn;
            PieceOfMessage of;
        };
        std::vector<Source> sources;
        for (std::uint32_t m = 0; m < incoming_.size(); ++m)
            for (std::uint32_t i = 0; i < incoming_[m].pieces.size(); ++i)
                sources.push_back({incoming_[m].pieces[i].block, incoming_[m].pieces[i].turn, {m, i}});
        for (const std::uint32_t i : own_pieces_) sources.push_back({pieces_[i].block, pieces_[i].turn, {own(), i}});
        std::sort(sources.begin(), sources.end(), [&](const Source& a, const Source& b) {
            if (a.block != b.block) return a.block < b.block;
            if (adds_own_first && (a.of.message == own()) != (b.of.message == own())) return a.of.message == own();
            if (a.turn != b.turn) return a.turn < b.turn;
            return std::pair(a.of.message, a.of.piece) < std::pair(b.of.message, b.of.piece);
        });
        for (std::size_t i = 0; i < sources.size(); ++i) {
            if (i == 0 || sources[i].block != sources[i - 1].block) {
                if (i > 0) sums_.close();
                summed_.push_back(sources[i].block);
            }
            sums_.items.push_back(sources[i].of);
        }
        if (!sources.empty()) sums_.close();

        to_return_ = returned(
            incoming_, [](std::uint32_t message, std::uint32_t piece) { return PieceOfMessage{message, piece}; });
        to_get_ = returned(outgoing_, [&](std::uint32_t message, std::uint32_t piece) {
            return PieceOfMessage{own(), std::uint32_t(outgoing_[message].first + piece)};
        });
    }
    /// Collects the blocks of messages that one rank has sent or receives.
    template <class Of>
    static std::vector<ReturnedBlocks> returned(const std::vector<PieceMessage>& messages, const Of& of) {
        struct Entry {
            int rank;
            std::uint32_t block, message, piece;
            auto operator<=>(const Entry&) const = default;
        };
        std::vector<Entry> entries;
        for (std::uint32_t m = 0; m < messages.size(); ++m)
            for (std::uint32_t i = 0; i < messages[m].pieces.size(); ++i)
                entries.push_back({messages[m].rank, messages[m].pieces[i].block, m, i});
        std::sort(entries.begin(), entries.end());
        std::vector<ReturnedBlocks> all;
        for (std::size_t i = 0; i < entries.size(); ++i) {
            if (i == 0 || entries[i].rank != entries[i - 1].rank) all.push_back({entries[i].rank});
            ReturnedBlocks& one = all.back();
            if (one.blocks.empty() || one.blocks.back() != entries[i].block) {
                if (!one.blocks.empty()) one.pieces.close();
                one.blocks.push_back(entries[i].block);
            }
            one.pieces.items.push_back(of(entries[i].message, entries[i].piece));
            if (i + 1 == entries.size() || entries[i + 1].rank != entries[i].rank) one.pieces.close();
        }
        for (ReturnedBlocks& one : all) one.masks.resize(one.blocks.size());
        return all;
    }

    template <class T>
    static void append(std::vector<std::byte>& bytes, const T& value) {
        const auto* const from = reinterpret_cast<const std::byte*>(&value);
        bytes.insert(bytes.end(), from, from + sizeof value);
    }
    template <class T>
    static T read(const std::vector<std::byte>& bytes, std::size_t at) {
        T value;
        std::memcpy(&value, bytes.data() + at, sizeof value);
        return value;
    }

    int me_ = 0;
    std::size_t block_count_ = 0, rows_ = 0;
    bool by_turn_ = true;
    std::uint32_t turns_ = 0;  // number of turns of one material
    std::vector<int> summing_rank_;
    std::vector<bool> is_shared_;
    std::vector<Piece> pieces_;
    std::vector<std::uint32_t> own_pieces_, piece_of_block_, table_;
    std::vector<std::vector<std::uint32_t>> boundary_groups_;
    std::vector<std::size_t> phases_of_batch_;
    std::vector<PieceMessage> outgoing_, incoming_;
    std::vector<std::uint32_t> summed_;
    Lists<PieceOfMessage> sums_;
    std::vector<ReturnedBlocks> to_return_, to_get_;
};

/// A grid whose shared blocks are replaced by pieces, for P2G. \see SharedBlocks
template <std::floating_point S, int D>
struct GridOfPieces {
    const SparseGrid<S, D>& grid;
    const SharedBlocks<D>& shared;

    const Domain<D>& domain() const { return grid.domain(); }
    const std::uint32_t* neighbours(const BlockPartition<D>& partition, std::size_t r) const {
        return shared.has_table() ? shared.neighbours(partition.first_row + r) : grid.neighbours(partition, r);
    }
};

}  // namespace firn::inline FIRN_BUILD::mpi::detail
