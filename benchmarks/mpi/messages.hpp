/// \file Counts the messages that the ranks of a distributed step send, from where the matter is. No MPI is needed.
///
/// A test compares the counts with messages that were sent (tests/mpi/message_counts.cpp). A block of nodes is shared
/// if it lies in the grids of several ranks (its contributors). One of them, the summing rank, adds the pieces that the
/// others send, in the order of turns, and sends the sums back. \see firn/mpi/shared_blocks.hpp
#pragma once

#include <firn/data/sparse_grid.hpp>
#include <firn/kernel/quadratic_b_spline.hpp>
#include <firn/mpi/cuts.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>
#include <span>
#include <unordered_map>
#include <vector>

namespace geometry {

using firn::BlockCoordinate, firn::block_size, firn::cube_blocks;

/// The particles of one set in one block.
template <int D>
struct BlockMatter {
    BlockCoordinate<D> block;     ///< coordinates of the block
    std::uint32_t particles = 0;  ///< number of particles that were sorted into the block
    std::uint16_t set = 0;        ///< index of the set (of the material)
    /// Lowest and highest base node of these particles along each axis, counted from the block's lower corner: 0 to 3
    /// just after sorting, −1 to 4 if particles have drifted.
    std::array<std::int8_t, std::size_t(D)> first{}, last{};
    /// How far these particles have moved when they are sorted next [cells]. \see RankCount::migrants
    std::array<float, std::size_t(D)> moved{};
};

/// What the size of messages depends on besides the matter.
template <int D>
struct Scheme {
    int support = firn::QuadraticBSpline::support;                   ///< nodes of a particle along an axis
    int colours = firn::colours_along_axis<firn::QuadraticBSpline>;  ///< colours of dense blocks along an axis
    std::size_t node_bytes = firn::node_width * sizeof(float);       ///< the numbers of a node
    std::size_t mask_bytes = sizeof(std::uint64_t);                  ///< which nodes of a piece are sent
    std::array<int, std::size_t(D)> period{};                        ///< blocks along periodic axes, or 0
};

/// What one rank sends to another in one step.
struct Bytes {
    std::size_t sums = 0;     ///< what its particles add to nodes that the other rank sums up
    std::size_t returns = 0;  ///< the sums of nodes that it sums up, and to which the other rank contributes
    unsigned batches = 0;     ///< which messages these are: bits 0 and 1: two halves of the sums, bit 2: returns

    std::size_t messages() const { return std::size_t(std::popcount(batches)); }
};

/// What one rank does in one step.
struct RankCount {
    std::size_t particles = 0;
    std::size_t blocks = 0;         ///< blocks that contain its particles
    std::size_t shared_blocks = 0;  ///< blocks of its grid that are in the grids of other ranks as well
    std::size_t pieces = 0;         ///< pieces of shared blocks to which it scatters
    std::size_t sums = 0;           ///< bytes of sums that it sends
    std::size_t returns = 0;        ///< bytes of returned sums that it sends
    std::size_t received = 0;       ///< bytes that it receives, both kinds
    std::size_t messages = 0;       ///< messages that it sends, both kinds. \see detail::Counter::split_turns
    std::size_t peers = 0;          ///< ranks with which it exchanges messages
    std::size_t additions = 0;      ///< floating-point additions when it sums up
    std::size_t outer = 0;          ///< its particles in groups that scatter to shared blocks
    double migrants = 0;            ///< particles that it sends to other ranks when they are sorted next
    std::size_t in_any_order = 0;   ///< bytes of sums that it would send if the order of additions did not matter
};

/// The messages of one step.
struct Messages {
    std::vector<RankCount> ranks;
    std::unordered_map<std::uint64_t, Bytes> pairs;  ///< key: sender · 2³² + receiver

    /// Returns the bytes that rank `from` sends to rank `to`.
    Bytes between(int from, int to) const {
        const auto found = pairs.find(pair(from, to));
        return found == pairs.end() ? Bytes{} : found->second;
    }
    static std::uint64_t pair(int from, int to) { return std::uint64_t(from) << 32 | std::uint64_t(to); }
};

/// Sorts matter along the curve: by cube, block and set.
template <int D>
void sort_along_curve(std::vector<BlockMatter<D>>& matter) {
    std::sort(matter.begin(), matter.end(), [](const auto& one, const auto& other) {
        return one.block != other.block ? firn::before_on_curve<D>(one.block, other.block) : one.set < other.set;
    });
}

/// Puts particles together block by block.
template <int D>
class Gathered {
public:
    /// Adds a particle.
    /// \param block        the block into which it was sorted
    /// \param node         its base node, counted from the domain's lower corner
    /// \param is_particle  false: padding, which belongs to the box of its group, but is no particle
    void add(const BlockCoordinate<D>& block, const std::array<int, std::size_t(D)>& node, int set,
             bool is_particle = true) {
        const auto [found, is_new] = blocks_.try_emplace({firn::block_key<D>(block), set});
        BlockMatter<D>& of = found->second;
        of.block = block;
        of.set = std::uint16_t(set);
        of.particles += is_particle;
        for (std::size_t a = 0; a < D; ++a) {
            const auto place = std::int8_t(node[a] - block_size * block[a]);
            of.first[a] = is_new ? place : std::min(of.first[a], place);
            of.last[a] = is_new ? place : std::max(of.last[a], place);
        }
    }
    /// Returns the matter, sorted along the curve.
    std::vector<BlockMatter<D>> matter() const {
        std::vector<BlockMatter<D>> all;
        for (const auto& [key, of] : blocks_) all.push_back(of);
        sort_along_curve(all);
        return all;
    }

private:
    std::map<std::pair<std::uint64_t, int>, BlockMatter<D>> blocks_{};
};

/// Returns cuts that give all ranks about equally many particles.
/// \param matter  sorted along the curve
template <int D>
firn::mpi::Cuts<D> cuts(std::span<const BlockMatter<D>> matter, int ranks) {
    std::vector<firn::mpi::CubeWeight> cubes;
    for (const auto& of : matter) {
        const std::uint64_t key = firn::curve_key<D>(firn::cube_of<D>(of.block));
        if (cubes.empty() || cubes.back().key != key) cubes.push_back({key, 0});
        cubes.back().weight += of.particles;
    }
    return firn::mpi::balanced_cuts<D>(std::span<const firn::mpi::CubeWeight>(cubes), ranks,
                                       [](std::span<std::uint64_t>) {});
}

namespace detail {

/// A box of nodes.
template <int D>
struct Box {
    std::array<int, std::size_t(D)> first, last;

    static Box empty() {
        Box box;
        box.first.fill(1 << 30);
        box.last.fill(-(1 << 30));
        return box;
    }
    void include(const Box& other) {
        for (std::size_t a = 0; a < D; ++a) {
            first[a] = std::min(first[a], other.first[a]);
            last[a] = std::max(last[a], other.last[a]);
        }
    }
    /// Returns the mask of the nodes of a block that lie in the box. \param corner  the block's first node
    std::uint64_t mask(const std::array<int, std::size_t(D)>& corner) const {
        std::uint64_t mask = 1;
        for (std::size_t a = 0; a < D; ++a) {
            std::uint64_t wider = 0;
            const int from = std::max(first[a] - corner[a], 0), to = std::min(last[a] - corner[a], block_size - 1);
            // Bit i of `mask` becomes bits block_size i + (from … to).
            for (std::uint64_t rest = mask; rest != 0; rest &= rest - 1)
                for (int k = from; k <= to; ++k) wider |= std::uint64_t(1) << (block_size * std::countr_zero(rest) + k);
            mask = wider;
        }
        return mask;
    }
};

/// The box of all nodes to which the particles of one set in one block contribute.
template <int D>
Box<D> reach(const BlockMatter<D>& of, int support) {
    Box<D> box;
    for (std::size_t a = 0; a < D; ++a) {
        box.first[a] = block_size * of.block[a] + of.first[a];
        box.last[a] = block_size * of.block[a] + of.last[a] + support - 1;
    }
    return box;
}

/// A cube of blocks with its matter.
template <int D>
struct Cube {
    std::uint64_t key;
    std::size_t first, last;  // indices in the matter
};

/// Counts block by block.
template <int D>
class Counter {
public:
    Counter(std::span<const BlockMatter<D>> matter, std::span<const firn::mpi::Cuts<D>> cuts, const Scheme<D>& scheme)
        : matter_(matter), cuts_(cuts), scheme_(scheme), owner_(matter.size()) {
        for (int a = 0; a < D; ++a) dense_turns_ *= unsigned(scheme.colours);
        result_.ranks.resize(cuts[0].first.size());
        for (std::size_t i = 0; i < matter.size(); ++i) {
            const std::uint64_t key = firn::curve_key<D>(firn::cube_of<D>(matter[i].block));
            if (cubes_.empty() || cubes_.back().key != key) {
                number_of_.emplace(key, std::uint32_t(cubes_.size()));
                cubes_.push_back({key, i, i});
            }
            cubes_.back().last = i + 1;
            owner_[i] = cuts[std::min<std::size_t>(matter[i].set, cuts.size() - 1)].owner_of_key(key);
            RankCount& rank = result_.ranks[std::size_t(owner_[i])];
            rank.particles += matter[i].particles;
            rank.blocks += i == 0 || matter[i].block != matter[i - 1].block;
        }
        find_split_turns();
    }

    Messages count() {
        outer_.assign(matter_.size(), false);
        std::vector<std::uint64_t> done;  // keys of the cubes around those that have matter and lie near a cut
        for (const auto& cube : cubes_) {
            const BlockCoordinate<D> at = firn::cube_of<D>(matter_[cube.first].block);
            if (!is_near_cut(at)) continue;
            for (std::size_t i = cube.first; i < cube.last; ++i) add_migrants(matter_[i], owner_[i]);
            for_around<D>([&](const auto& offset) {
                BlockCoordinate<D> other = at;
                for (std::size_t a = 0; a < D; ++a) other[a] = in_period(at[a] + offset[a], a);
                done.push_back(firn::block_key<D>(other));
            });
        }
        std::sort(done.begin(), done.end());
        done.erase(std::unique(done.begin(), done.end()), done.end());
        for (const std::uint64_t key : done) visit(firn::block_of_key<D>(key));
        for (const auto& cube : cubes_)
            for (std::size_t i = cube.first; i < cube.last; ++i)
                if (outer_[i]) result_.ranks[std::size_t(owner_[i])].outer += matter_[i].particles;
        for (const auto& [pair, bytes] : result_.pairs) {
            RankCount &from = result_.ranks[pair >> 32], &to = result_.ranks[pair & 0xffffffffu];
            from.sums += bytes.sums;
            from.returns += bytes.returns;
            from.messages += bytes.messages();
            to.received += bytes.sums + bytes.returns;
            ++from.peers;  // the other rank sends as well: sums or returns
        }
        return std::move(result_);
    }

private:
    struct Piece {
        int rank;
        unsigned place;  // turn and set: the place in the order of additions
        std::uint64_t mask;
    };

    /// Calls f(offset) for each offset from −1 to 1 along all axes.
    template <int N, class F>
    static void for_around(const F& f) {
        for (int k = 0, all = D == 2 ? 9 : 27; k < all; ++k) {
            std::array<int, std::size_t(N)> offset{};
            for (int a = N - 1, rest = k; a >= 0; --a, rest /= 3) offset[std::size_t(a)] = rest % 3 - 1;
            f(offset);
        }
    }
    int in_period(int cube, std::size_t axis) const {
        const int n = scheme_.period[axis] / cube_blocks;
        return n > 0 ? firn::modulo(cube, n) : cube;
    }

    /// Returns whether another rank may own a cube at a distance of at most two cubes. A cube of 4^D cubes whose
    /// coordinates are multiples of 4 is an interval of the curve.
    bool is_near_cut(const BlockCoordinate<D>& cube) const {
        for (const int n : scheme_.period)
            if (n > 0) return true;
        if (cuts_.size() > 1) return true;
        const int owner = cuts_[0].owner_of_key(firn::curve_key<D>(cube));
        bool near = false;
        for (int k = 0; k < 1 << D && !near; ++k) {
            BlockCoordinate<D> low{};
            for (std::size_t a = 0; a < D; ++a) low[a] = (cube[a] + (k >> a & 1 ? 2 : -2)) & ~3;
            const std::uint64_t key = firn::curve_key<D>(low), last = key + (std::uint64_t(1) << 2 * D) - 1;
            near = cuts_[0].owner_of_key(key) != owner || cuts_[0].owner_of_key(last) != owner;
        }
        return near;
    }

    /// Adds the particles of a block that will leave for the blocks of other ranks: the part of the block that its
    /// motion carries across a face. Cuts stay where they are.
    void add_migrants(const BlockMatter<D>& of, int owner) {
        for_around<D>([&](const auto& offset) {
            double part = of.particles;
            BlockCoordinate<D> to = of.block;
            for (std::size_t a = 0; a < D; ++a) {
                const double across = std::min(double(std::abs(of.moved[a])) / block_size, 1.0);
                const bool with = offset[a] != 0 && (offset[a] > 0) == (of.moved[a] > 0);
                part *= offset[a] == 0 ? 1 - across : with ? across : 0;
                to[a] += offset[a];
            }
            if (part == 0) return;
            BlockCoordinate<D> cube = firn::cube_of<D>(to);
            for (std::size_t a = 0; a < D; ++a) cube[a] = in_period(cube[a], a);
            if (cuts_[0].owner_of_key(firn::curve_key<D>(cube)) != owner)
                result_.ranks[std::size_t(owner)].migrants += part;
        });
    }

    /// Counts the shared blocks of a cube.
    void visit(const BlockCoordinate<D>& cube) {
        // The cubes around, with their groups of sparse blocks.
        struct Around {
            const Cube<D>* cube = nullptr;
            std::array<int, std::size_t(D)> shift{};                 // blocks, across the ends of periodic axes
            std::vector<std::pair<std::uint16_t, Box<D>>> sparse{};  // for each set
            unsigned parity = 0;
        };
        std::vector<Around> around;
        int owner = -1;
        bool several = false;
        for_around<D>([&](const auto& offset) {
            Around& of = around.emplace_back();
            BlockCoordinate<D> at = cube;
            for (std::size_t a = 0; a < D; ++a) {
                at[a] = in_period(cube[a] + offset[a], a);
                of.shift[a] = (cube[a] + offset[a] - at[a]) * cube_blocks;
                of.parity = of.parity << 1 | unsigned(at[a] & 1);
            }
            const auto found = number_of_.find(firn::curve_key<D>(at));
            if (found == number_of_.end()) return;
            of.cube = &cubes_[found->second];
            for (std::size_t i = of.cube->first; i < of.cube->last; ++i) {
                several = several || (owner >= 0 && owner != owner_[i]);
                owner = owner_[i];
            }
        });
        if (!several) return;
        for (Around& of : around) {
            if (!of.cube) continue;
            for (std::size_t i = of.cube->first; i < of.cube->last; ++i) {
                if (matter_[i].particles > firn::sparse_particles) continue;
                auto group = std::find_if(of.sparse.begin(), of.sparse.end(),
                                          [&](const auto& one) { return one.first == matter_[i].set; });
                if (group == of.sparse.end()) group = of.sparse.insert(group, {matter_[i].set, Box<D>::empty()});
                group->second.include(reach<D>(matter_[i], scheme_.support));
            }
        }
        const int owner_of_cube = cuts_[0].owner_of_key(firn::curve_key<D>(cube));
        for (int k = 0; k < 1 << D; ++k) {
            BlockCoordinate<D> block{};
            for (std::size_t a = 0; a < D; ++a) block[a] = cube_blocks * cube[a] + (k >> (D - 1 - a) & 1);
            pieces_.clear();
            beside_.clear();
            for (const Around& of : around)
                if (of.cube) collect(block, *of.cube, of.shift, of.sparse, of.parity);
            count_block(owner_of_cube);
        }
    }

    /// Collects the pieces of a block to which the groups of a cube contribute.
    template <class Sparse>
    void collect(const BlockCoordinate<D>& block, const Cube<D>& cube, const std::array<int, std::size_t(D)>& shift,
                 const Sparse& sparse, unsigned parity) {
        std::array<int, std::size_t(D)> corner{};
        for (std::size_t a = 0; a < D; ++a) corner[a] = block_size * (block[a] - shift[a]);
        for (std::size_t i = cube.first; i < cube.last; ++i) {
            const BlockMatter<D>& of = matter_[i];
            bool beside = true;
            for (std::size_t a = 0; a < D; ++a) {
                const int distance = of.block[a] + shift[a] - block[a];
                beside = beside && distance >= -1 && distance <= 1;
            }
            if (!beside) continue;
            beside_.push_back(i);
            const bool dense = of.particles > firn::sparse_particles;
            const unsigned turn =
                dense ? unsigned(firn::block_colour<D>(of.block, scheme_.colours)) : dense_turns_ + parity;
            const auto box = [&] {
                if (dense) return reach<D>(of, scheme_.support);
                return std::find_if(sparse.begin(), sparse.end(), [&](const auto& one) { return one.first == of.set; })
                    ->second;
            }();
            add({owner_[i], turn + of.set * turns(), box.mask(corner)});
        }
    }
    void add(const Piece& piece) {
        for (Piece& other : pieces_)
            if (other.rank == piece.rank && other.place == piece.place) {
                other.mask |= piece.mask;
                return;
            }
        pieces_.push_back(piece);
    }

    /// Counts the messages of a block, from its pieces.
    void count_block(int owner_of_cube) {
        int lowest = int(result_.ranks.size()), highest = -1;
        bool contributes = false;
        for (const Piece& piece : pieces_) {
            lowest = std::min(lowest, piece.rank);
            highest = std::max(highest, piece.rank);
            contributes = contributes || piece.rank == owner_of_cube;
        }
        if (lowest >= highest) return;  // not shared
        for (const std::size_t i : beside_) outer_[i] = true;
        const int summing = contributes ? owner_of_cube : lowest;
        std::sort(pieces_.begin(), pieces_.end(), [](const auto& one, const auto& other) {
            return one.rank != other.rank ? one.rank < other.rank : one.place < other.place;
        });
        for (std::size_t i = 0; i < pieces_.size();) {
            const int rank = pieces_[i].rank;
            std::size_t nodes = 0, pieces = 0;
            std::uint64_t any = 0;
            unsigned batches = 0;
            for (; i < pieces_.size() && pieces_[i].rank == rank; ++i, ++pieces) {
                batches |= pieces_[i].place < split_turn_[std::size_t(rank)] ? 1 : 2;
                nodes += std::size_t(std::popcount(pieces_[i].mask));
                any |= pieces_[i].mask;
            }
            RankCount& count = result_.ranks[std::size_t(rank)];
            ++count.shared_blocks;
            count.pieces += pieces;
            result_.ranks[std::size_t(summing)].additions += nodes * firn::node_width;
            if (rank == summing) continue;
            const std::size_t returned = scheme_.node_bytes * std::size_t(std::popcount(any));
            Bytes& to = result_.pairs[Messages::pair(rank, summing)];
            to.sums += pieces * scheme_.mask_bytes + scheme_.node_bytes * nodes;
            to.batches |= batches;
            Bytes& back = result_.pairs[Messages::pair(summing, rank)];
            back.returns += returned;
            back.batches |= 4;
            count.in_any_order += scheme_.mask_bytes + returned;
        }
    }

    unsigned turns() const { return dense_turns_ + (1u << D); }
    /// Finds, for each rank, the first turn whose pieces are sent after all groups were scattered. Pieces of the turns
    /// before are sent when about half of the particles were scattered. If the sparse groups of a set include the
    /// middle particle, this is a guess: the true place depends on their phases.
    void find_split_turns() {
        const std::size_t ranks = result_.ranks.size();
        split_turn_.assign(ranks, 0);
        std::map<unsigned, std::vector<std::size_t>> particles;  // by turn and rank; sparse groups: one turn
        for (std::size_t i = 0; i < matter_.size(); ++i) {
            const bool dense = matter_[i].particles > firn::sparse_particles;
            const unsigned turn =
                dense ? unsigned(firn::block_colour<D>(matter_[i].block, scheme_.colours)) : turns() - 1;
            auto& of = particles[turn + matter_[i].set * turns()];
            of.resize(ranks);
            of[std::size_t(owner_[i])] += matter_[i].particles;
        }
        for (std::size_t r = 0; r < ranks; ++r) {
            std::size_t sum = 0;
            for (const auto& [turn, of] : particles) {
                if (2 * sum >= result_.ranks[r].particles) break;
                const bool is_sparse = turn % turns() == turns() - 1;
                if (is_sparse && 2 * (sum + of[r]) >= result_.ranks[r].particles) break;
                sum += of[r];
                if (of[r] > 0) split_turn_[r] = turn + 1;
            }
        }
    }

    std::span<const BlockMatter<D>> matter_;
    std::span<const firn::mpi::Cuts<D>> cuts_;  // for each set, or one for all
    Scheme<D> scheme_;
    unsigned dense_turns_ = 1;            // colours of dense blocks
    std::vector<int> owner_;              // for all matter
    std::vector<unsigned> split_turn_{};  // for each rank
    std::vector<Cube<D>> cubes_{};
    std::unordered_map<std::uint64_t, std::uint32_t> number_of_{};  // index in cubes_ by key
    std::vector<Piece> pieces_{};                                   // of the block that is counted
    std::vector<std::size_t> beside_{};                             // indices of the matter around this block
    std::vector<bool> outer_{};                                     // for all matter: whether it is near a shared block
    Messages result_{};
};

}  // namespace detail

/// Counts the messages of one step.
/// \param matter  sorted along the curve. \see sort_along_curve
/// \param cuts    which rank owns which cubes: for each set of particles, or one for all
template <int D>
Messages count_messages(std::span<const BlockMatter<D>> matter, std::span<const firn::mpi::Cuts<D>> cuts,
                        const Scheme<D>& scheme = {}) {
    return detail::Counter<D>(matter, cuts, scheme).count();
}

}  // namespace geometry
