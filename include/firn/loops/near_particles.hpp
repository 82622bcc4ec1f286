/// \file The particles around the nodes at which contact is possible. Each of them is found once a step, and sorted by
/// its base node, then by its id. So sums over them depend neither on the order of the particles in memory nor on the
/// block into which a particle was sorted.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/box_masks.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/data/particle_view.hpp>
#include <firn/loops/around_node.hpp>
#include <firn/math/exp_log.hpp>
#include <firn/simd/transpose.hpp>
#include <firn/sort/block_numbers.hpp>
#include <firn/stage/mirror_planes.hpp>
#include <firn/stage/volume_filter.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD {

namespace detail {

/// Returns the volume ratios J of particles; 1 for a material that has neither F nor J.
template <class View, class P>
FIRN_INLINE P volume_ratio_of(const View& view, const Slots& slots) {
    using State = typename View::state_type;
    if constexpr (has_volume_ratio<State>) {
        using J = typename Stored<decltype(State::J)>::template With<P>;
        return load_value<J>(view.state[field_of(&State::J)], slots);
    } else if constexpr (has_volume<State>) {
        using F = typename Stored<decltype(State::F)>::template With<P>;
        const Mat<P, firn::dimension_of<F>> of_particles = load_value<F>(view.state[field_of(&State::F)], slots);
        return determinant(of_particles);
    } else {
        return P(1);
    }
}

/// Returns half of the extents of particles [cells]: ½ (J V0)^(1/D) / h.
/// \param h  cell size [m]
template <class P, class View>
FIRN_INLINE P radius_of(const View& view, const Slots& slots, double h) {
    using S = typename View::scalar_type;
    constexpr int D = View::dimension;
    const P per_cell(S(D == 2 ? 1 / (h * h) : 1 / (h * h * h)));
    const P volume = view.volume.template load<P>(slots, 0) * volume_ratio_of<View, P>(view, slots) * per_cell;
    const P filled = max(volume, P(S(1e-12)));
    const P extent = D == 2 ? sqrt(filled) : exp(log(filled) * P(S(1.0 / 3)));
    return select(volume > P(S(1e-12)), extent * P(S(0.5)), P(S(0)));
}

}  // namespace detail

/// Lists of particles, one for each block of base nodes that is wanted.
///
/// After the grid was activated: clear(), want_around() for each block of nodes, connect(). In every step:
/// mark_around() for the nodes that this step needs, find(), then gather() for each node.
template <class Kernel, int D>
class NearParticles {
    static constexpr int K = Kernel::support;
    static constexpr int around = D == 2 ? 9 : 27;

public:
    /// A particle. Its position is counted from the corner of the block of its base node [cells].
    struct Particle {
        float place[3];    ///< position [cells]; in 2D, the third number is 0
        float radius;      ///< half of the particle's extent [cells]
        std::uint32_t id,  ///< id of the particle
            bin;           ///< number of its base node in the block, the last axis fastest

        /// Compares the ids; of a particle and its mirror image, the positions.
        bool operator<(const Particle& other) const {
            if (id != other.id) return id < other.id;
            return std::lexicographical_compare(place, place + D, other.place, other.place + D);
        }
    };
    static constexpr std::uint32_t none = BlockNumbers::none;  ///< Stands for a block that is not wanted.
    /// Numbers of the blocks in which the base nodes of the particles around the nodes of a block may lie: bit D − 1 −
    /// a of an index is 0 for the block before the nodes' block along axis a, and 1 for the nodes' block.
    using Blocks = std::array<std::uint32_t, std::size_t(1 << D)>;

    /// Forgets all blocks.
    void clear() {
        numbers_.clear();
        sources_.clear(), ranges_.clear();
    }
    /// Returns the number of a block. The numbers are 0, 1, …
    /// \param block  coordinates of the block, or of a copy of it
    std::uint32_t want(const Domain<D>& domain, const BlockCoordinate<D>& block) {
        return numbers_.number(block_key<D>(wrapped(domain, block)));
    }
    /// Returns the numbers of the blocks in which the base nodes of the particles around a block's nodes may lie.
    /// \param block  coordinates of the block, or of a copy of it
    Blocks want_around(const Domain<D>& domain, const BlockCoordinate<D>& block) {
        Blocks blocks;
        for (int k = 0; k < 1 << D; ++k) blocks[std::size_t(k)] = want(domain, block_before<D>(block, k));
        return blocks;
    }
    std::size_t size() const { return numbers_.size(); }                            ///< Number of blocks.
    std::uint64_t key(std::uint32_t number) const { return numbers_.key(number); }  ///< Returns the key of a block.
    /// Returns the number of the block that has a key; `none` if the block is not wanted.
    std::uint32_t find(std::uint64_t key) const { return numbers_.find(key); }

    /// Finds the ranges of particles whose base nodes may lie in the wanted blocks.
    void connect(const Domain<D>& domain, std::span<const BlockPartition<D>* const> partitions) {
        if (blocks_.size() < size()) blocks_.resize(size());
        marked_.assign(size(), 0);
        const auto neighbour = [&](std::uint64_t key, int k) {
            BlockCoordinate<D> block = block_of_key<D>(key);
            for (int a = D - 1; a >= 0; --a, k /= 3) block[std::size_t(a)] += k % 3 - 1;
            return block_key<D>(wrapped(domain, block));
        };
        // The blocks that may be sources: those with particles, or, if these are more, those around the wanted ones.
        BlockNumbers candidates;
        std::size_t with_particles = 0;
        for (const auto* partition : partitions) with_particles += partition->ranges.size();
        if (with_particles <= size()) {
            for (const auto* partition : partitions)
                for (const std::uint32_t r : partition->by_block)
                    candidates.number(block_key<D>(partition->ranges[r].block));
        } else {
            for (std::uint32_t b = 0; b < size(); ++b)
                for (int k = 0; k < around; ++k) candidates.number(neighbour(this->key(b), k));
        }
        for (const std::uint64_t key : candidates.keys()) {
            Source source{block_of_key<D>(key), std::uint32_t(ranges_.size()), 0, {}, {}, {}, {}, {}};
            for (int to = 0; to < around; ++to) source.to[std::size_t(to)] = numbers_.find(neighbour(key, to));
            if (std::ranges::count(source.to, none) == around) continue;
            for (std::uint32_t s = 0; s < partitions.size(); ++s) {
                const BlockPartition<D>& partition = *partitions[s];
                const auto key_of = [&](std::uint32_t r) { return block_key<D>(partition.ranges[r].block); };
                const auto found = std::ranges::lower_bound(partition.by_block, key, {}, key_of);
                if (found != partition.by_block.end() && key_of(*found) == key) ranges_.emplace_back(s, *found);
            }
            source.last = std::uint32_t(ranges_.size());
            if (source.first < source.last) sources_.push_back(source);
        }
        for (std::uint32_t b = 0; b < size(); ++b) blocks_[b].sources.clear();
        for (std::uint32_t s = 0; s < sources_.size(); ++s)
            for (const std::uint32_t b : sources_[s].to)
                if (b != none && (blocks_[b].sources.empty() || blocks_[b].sources.back() != s))
                    blocks_[b].sources.push_back(s);
    }

    /// Tells which particles of a block are needed in this step. Threads may call it at the same time.
    /// \param bins  a set of bits, one for each base node. \see bins_that_reach
    void mark(std::uint32_t number, std::uint64_t bins) {
        if (bins != 0) std::atomic_ref(marked_[number]).fetch_or(bins, std::memory_order_relaxed);
    }
    /// Tells that the particles around some nodes of a block are needed in this step.
    /// \param blocks  what want_around() returned for the block;  \param nodes  a set of bits, one for each node
    void mark_around(const Blocks& blocks, std::uint64_t nodes) {
        const auto bins = bins_that_reach(nodes);
        for (int k = 0; k < 1 << D; ++k) mark(blocks[std::size_t(k)], bins[std::size_t(k)]);
    }
    /// Returns for each of the blocks around some nodes a set of bits, one for each base node whose particles
    /// contribute to one of these nodes. \see Blocks
    /// \param nodes  a set of bits, one for each node
    static std::array<std::uint64_t, std::size_t(1 << D)> bins_that_reach(std::uint64_t nodes) {
        std::array<std::uint64_t, std::size_t(1 << D)> bins{};
        bins[0] = nodes;
        // Along each axis, bit i of a set moves to the bits i, i − 1, …: in the block, and in the block before it.
        for (int a = 0; a < D; ++a) {
            const int apart = 1 << (2 * (D - 1 - a));
            for (int k = (1 << a) - 1; k >= 0; --k) {
                const std::uint64_t here = bins[std::size_t(k)];
                std::uint64_t in_block = here, before = 0;
                for (int s = 1; s < K; ++s) {
                    in_block |= here >> (s * apart) & detail::BoxMasks<D>::along(a, (1u << (block_size - s)) - 1);
                    before |= here << ((block_size - s) * apart) &
                              detail::BoxMasks<D>::along(a, 0xfu & ~((1u << (block_size - s)) - 1));
                }
                bins[std::size_t(2 * k)] = before;
                bins[std::size_t(2 * k + 1)] = in_block;
            }
        }
        return bins;
    }

    /// Finds the particles of the marked blocks, and removes the marks.
    /// \param mirrors  walls behind which particles have mirror images; these count as particles
    /// \param share    called as share(*this) between finding and sorting: may change found()
    template <class Share, class View>
    void find(const Domain<D>& domain, const Mirrors& mirrors, int threads, const Share& share,
              ParticleSets<View> sets) {
        parallel_for(sources_.size(), threads, [&](std::size_t s, int) {
            Source& source = sources_[s];
            source.strays.clear(), source.images.clear();
            const bool is_needed =
                std::any_of(source.to.begin(), source.to.end(), [&](auto b) { return is_marked(b); });
            if (!is_needed && mirrors.planes.empty()) return;
            find_needed(source);
            for (std::uint32_t r = source.first; r < source.last; ++r)
                convert(source, sets[ranges_[r].first], ranges_[r].second, domain, mirrors);
            if (is_marked(source.to[around / 2]))
                blocks_[source.to[around / 2]].sort();  // as long as it is in the cache
        });
        if (std::ranges::any_of(sources_, [](const Source& source) { return !source.strays.empty(); }))
            parallel_for(size(), threads, [&](std::size_t b, int) {
                if (!marked_[b]) return;
                for (const std::uint32_t s : blocks_[b].sources)
                    for (const auto& [to, particle] : sources_[s].strays)
                        if (to == b) blocks_[b].found.push_back(particle);
            });
        if (!mirrors.planes.empty())
            for (const Source& source : sources_)
                for (const auto& [to, particle] : source.images) blocks_[to].found.push_back(particle);
        share(*this);
        parallel_for(size(), threads, [&](std::size_t b, int) {
            if (!marked_[b]) return;
            marked_[b] = 0;
            Block& block = blocks_[b];
            if (!block.is_sorted || block.begin.back() != block.found.size()) block.sort();
            block.is_sorted = false;
            block.found.clear();
        });
    }
    /// Returns the particles of a block, in any order, for find()'s `share`.
    std::vector<Particle>& found(std::uint32_t number) { return blocks_[number].found; }
    /// Returns whether particles of a block are needed.
    bool is_marked(std::uint32_t number) const { return number != none && marked_[number] != 0; }
    /// Returns whether the particles of a base node are needed.
    bool is_marked(std::uint32_t number, std::uint32_t bin) const {
        return number != none && (marked_[number] >> bin & 1) != 0;
    }

    /// Collects the particles around some nodes of a block.
    /// \param blocks  what want_around() returned for the block
    /// \param nodes   a set of bits, one for each node whose particles are wanted. They must have been marked
    /// \param to      receives the particles; AroundNode(to, node) are those around one of the nodes
    void gather(const Blocks& blocks, std::uint64_t nodes, detail::AroundBlock<Kernel, D>& to) const {
        const auto wanted = bins_that_reach(nodes);
        std::size_t most = 0;
        for (int k = 0; k < 1 << D; ++k)
            if (wanted[std::size_t(k)] != 0) most += blocks_[blocks[std::size_t(k)]].begin.back();
        to.rows.reserve(most);
        constexpr int before = K - 1;  // number of base nodes of a line that lie in the block before
        for (int line = 0; line < detail::AroundBlock<Kernel, D>::lines; ++line) {
            static constexpr auto places = line_places();
            auto [block, bin, shift] = places[std::size_t(line)];
            const unsigned bins[2] = {unsigned(wanted[block] >> bin) & 0xf, unsigned(wanted[block + 1] >> bin) & 0xf};
            if ((bins[0] | bins[1]) == 0) continue;
            std::uint32_t* begin = to.begin[line];
            for (std::size_t side = 0; side < 2; ++side) {
                const int from = side == 0 ? block_size - before : 0;
                if (bins[side] == 0) {
                    begin = std::fill_n(begin, block_size - from, to.rows.size());
                    continue;
                }
                const Block& of = blocks_[blocks[block + side]];
                const std::uint32_t* const of_bins = of.begin.data() + bin;
                const std::uint32_t first = of_bins[std::countr_zero(bins[side])],
                                    last = of_bins[std::bit_width(bins[side])];
                for (int c = from; c < block_size; ++c)
                    *begin++ = to.rows.size() + (std::clamp(of_bins[c], first, last) - first);
                shift[D - 1] = float(side == 0 ? -block_size : 0);
                to.rows.add(of.quads.data() + std::size_t(first) * 4, last - first, shift);
            }
            *begin = to.rows.size();
        }
    }

private:
    /// Where a line of base nodes around a block lies: its first nodes in one of Blocks, the others in the next one.
    struct LinePlace {
        std::size_t block;           // index of the first of the two
        int bin;                     // number of the base node with which the line would begin in either of them
        std::array<float, D> shift;  // the place of their corners, counted from that of the block, across the line
    };
    /// Returns the places of all lines.
    static constexpr auto line_places() {
        constexpr int across = detail::AroundBlock<Kernel, D>::across;
        std::array<LinePlace, std::size_t(detail::AroundBlock<Kernel, D>::lines)> places{};
        for (int line = 0; line < int(places.size()); ++line) {
            LinePlace& place = places[std::size_t(line)];
            for (int a = 0; a < D - 1; ++a) {
                const int base = (a == D - 2 ? line % across : line / across) - (K - 1);
                place.block = 2 * place.block + (base >= 0);
                place.bin = block_size * place.bin + (base & (block_size - 1));
                place.shift[std::size_t(a)] = float(base >= 0 ? 0 : -block_size);
            }
            place.block *= 2, place.bin *= block_size;
        }
        return places;
    }

    /// The particles of one block of base nodes.
    struct Block {
        std::vector<std::uint32_t> sources;  // whose particles may have base nodes in this block
        std::vector<Particle> found;         // in find(); else empty
        std::array<std::uint32_t, std::size_t(block_nodes<D>) + 1> begin{};
        std::vector<float> quads;  // of the sorted particles: positions and radii
        std::vector<std::uint32_t> order;
        bool is_sorted = false;  // whether sort() was called in this step; particles may have been added since then

        void sort() {
            is_sorted = true;
            begin.fill(0);
            for (const Particle& p : found) ++begin[p.bin + 1];
            for (std::size_t i = 1; i < begin.size(); ++i) begin[i] += begin[i - 1];
            auto next = begin;
            if (order.size() < found.size()) order.resize(found.size());
            for (std::uint32_t i = 0; i < found.size(); ++i) {
                const std::uint32_t first = begin[found[i].bin];
                std::uint32_t at = next[found[i].bin]++;
                for (; at > first && found[i] < found[order[at - 1]]; --at) order[at] = order[at - 1];
                order[at] = i;
            }
            if (const std::size_t count = (found.size() + detail::ParticleRows<D>::spare) * 4; quads.size() < count)
                quads.resize(count + count / 4);
            for (std::size_t i = 0; i < found.size(); ++i)
                std::memcpy(quads.data() + i * 4, found[order[i]].place, 4 * sizeof(float));
        }
    };
    /// A block with particles.
    struct Source {
        BlockCoordinate<D> block;
        std::uint32_t first, last;                          // of its ranges in ranges_
        int low[D], high[D];                                // the base nodes that are needed lie in this box
        std::array<std::uint32_t, std::size_t(around)> to;  // numbers of the wanted blocks around it
        std::vector<std::pair<std::uint32_t, Particle>> strays, images;  // in other blocks: its particles, their images
    };

    /// Finds a box of base nodes, counted from the corner of a block of particles, outside of which none is needed.
    void find_needed(Source& source) const {
        int(&low)[D] = source.low, (&high)[D] = source.high;
        std::fill_n(low, D, block_size);
        std::fill_n(high, D, -1);
        for (int k = 0; k < around; ++k) {
            if (!is_marked(source.to[std::size_t(k)])) continue;
            const std::uint64_t bins = marked_[source.to[std::size_t(k)]];
            for (int a = D - 1, rest = k; a >= 0; --a, rest /= 3)
                for (int v = 0; v < block_size; ++v) {
                    if (!(bins & detail::BoxMasks<D>::along(a, 1u << v))) continue;
                    low[a] = std::min(low[a], v + (rest % 3 - 1) * block_size);
                    high[a] = std::max(high[a], v + (rest % 3 - 1) * block_size);
                }
        }
        for (int a = 0; a < D; ++a) {
            low[a] = std::max(low[a], -allowed_drift);
            high[a] = std::min(high[a], block_size - 1 + allowed_drift);
        }
    }

    /// Adds the particles of a range to the blocks in which their base nodes lie.
    template <class View>
    void convert(Source& source, const ParticleSet<View>& set, std::uint32_t range, const Domain<D>& domain,
                 const Mirrors& mirrors) {
        using S = typename View::scalar_type;
        using P = native_pack<S>;
        constexpr int lanes = scalar_traits<P>::lanes;
        const BlockRange<D>& of = set.partition.ranges[range];
        const std::size_t end = of.first_slot + of.particles;
        for (std::size_t slot = of.first_slot / lanes * lanes; slot < end; slot += lanes) {
            const Slots slots{slot, nullptr};
            const Vec<P, D> place = load_vector<P, D>(set.view.position, slots);
            alignas(64) S bins[lanes], blocks[lanes], quads[lanes][4];
            P quad[4];
            auto is_needed = P(1) > P(0);
            P bin(0), to(0);  // the base node in its block; which of the blocks around has it
            for (int a = 0; a < D; ++a) {
                const P base = base_node<Kernel>(place.v[a]), block = floor(base * P(S(1.0 / block_size)));
                is_needed = is_needed & (base >= P(S(source.low[a]))) & (base <= P(S(source.high[a])));
                bin = bin * P(S(block_size)) + (base - block * P(S(block_size)));
                to = to * P(S(3)) + (block + P(S(1)));
                quad[a] = place.v[a] - block * P(S(block_size));
            }
            std::uint32_t left = lane_bits(is_needed);
            if (slot < of.first_slot) left &= ~0u << (of.first_slot - slot);
            if (slot + lanes > end) left &= (1u << (end - slot)) - 1;
            if (left == 0) continue;
            bin.store(bins), to.store(blocks);
            if constexpr (D == 2) quad[2] = P(0);
            quad[3] = detail::radius_of<P>(set.view, slots, domain.cell_size);
            store_quads(quad, quads[0]);
            for (; left != 0; left &= left - 1) {
                const int l = std::countr_zero(left);
                const auto number = source.to[std::size_t(blocks[l])];
                const auto bin_of = std::uint32_t(bins[l]);
                if (!is_marked(number, bin_of)) continue;
                const S* const q = quads[quad_of_lane<P>(l)];
                const Particle particle{{float(q[0]), float(q[1]), float(q[2])},
                                        float(q[3]),
                                        set.partition.order[slot + std::size_t(l)],
                                        bin_of};
                if (number == source.to[around / 2])
                    blocks_[number].found.push_back(particle);
                else
                    source.strays.emplace_back(number, particle);
            }
        }
        if (!mirrors.planes.empty()) add_images(source, set, of, domain, mirrors);
    }

    /// How the mirror images of the particles of a block are found.
    struct Image {
        bool reflects[D] = {};  ///< whether each axis is reflected
        int twice[D] = {};      ///< twice the node of the mirror, counted from the corner of the particles' block
        int low[D], count[D];   ///< the blocks in which base nodes of the images may lie: the first, and how many
        std::array<std::uint32_t, std::size_t(around)> to;  ///< their numbers, the last axis fastest
    };
    /// Finds the blocks in which base nodes of images may lie. Returns whether one of them is needed.
    bool find_blocks(Image& image, const BlockCoordinate<D>& block, int shift, const Domain<D>& domain) const {
        if (std::none_of(image.reflects, image.reflects + D, [](bool reflects) { return reflects; })) return false;
        int all = 1;
        for (int a = 0; a < D; ++a) {
            const int first = image.reflects[a] ? image.twice[a] - block_size - allowed_drift - K + 1 : -allowed_drift;
            const int last = image.reflects[a] ? image.twice[a] + allowed_drift : block_size - 1 + allowed_drift;
            image.low[a] = first >> 2;
            image.count[a] = (last >> 2) - image.low[a] + 1;
            all *= image.count[a];
        }
        bool needed = false;
        for (int k = 0; k < all; ++k) {
            BlockCoordinate<D> to = block;
            for (int a = D - 1, rest = k; a >= 0; rest /= image.count[a--])
                to[std::size_t(a)] += image.low[a] + rest % image.count[a];
            to[0] += shift;
            image.to[std::size_t(k)] = numbers_.find(block_key<D>(wrapped(domain, to)));
            needed = needed || is_marked(image.to[std::size_t(k)]);
        }
        return needed;
    }

    /// Adds the mirror images of the particles of a range.
    template <class View>
    [[gnu::cold]] void add_images(Source& source, const ParticleSet<View>& set, const BlockRange<D>& range,
                                  const Domain<D>& domain, const Mirrors& mirrors) {
        using S = typename View::scalar_type;
        using P = native_pack<S>;
        const int stride = copy_stride(domain), shift = group_of_copy(source.block[0], stride) * stride;
        BlockCoordinate<D> block = source.block;
        block[0] -= shift;
        std::vector<Image> images(1);
        for (const MirrorPlane& plane : mirrors.planes) {
            const int node = plane.node - block[std::size_t(plane.axis)] * block_size;
            if (plane.contact == Contact::none || std::abs(node) > 3 * block_size) continue;
            for (std::size_t i = 0, count = images.size(); i < count; ++i) {
                if (images[i].reflects[plane.axis]) continue;
                images.push_back(images[i]);
                images.back().reflects[plane.axis] = true;
                images.back().twice[plane.axis] = 2 * node;
            }
        }
        std::erase_if(images, [&](Image& image) { return !find_blocks(image, block, shift, domain); });
        if (images.empty()) return;
        constexpr int lanes = scalar_traits<P>::lanes;
        const std::size_t end = range.first_slot + range.particles;
        for (std::size_t first = range.first_slot / lanes * lanes; first < end; first += lanes) {
            const Slots slots{first, nullptr};
            const Vec<P, D> place = load_vector<P, D>(set.view.position, slots);
            alignas(64) S radii[lanes];
            bool has_radii = false;
            for (std::size_t slot = std::max(first, range.first_slot); slot < std::min(first + lanes, end); ++slot)
                for (const Image& image : images) {
                    const int lane = int(slot - first);
                    Particle particle{{}, 0, set.partition.order[slot], 0};
                    int to = 0;
                    bool is_inside = true;
                    for (int a = 0; a < D; ++a) {
                        const S at = image.reflects[a] ? -place.v[a][lane] : place.v[a][lane];
                        const int base = image.twice[a] + int(base_node<Kernel>(at)), blocks = base >> 2;
                        is_inside = is_inside && blocks >= image.low[a] && blocks < image.low[a] + image.count[a];
                        to = to * image.count[a] + (blocks - image.low[a]);
                        particle.bin = particle.bin * block_size + std::uint32_t(base & (block_size - 1));
                        particle.place[a] = float(at + S(image.twice[a] - block_size * blocks));
                    }
                    if (!is_inside) continue;
                    const std::uint32_t number = image.to[std::size_t(to)];
                    if (!is_marked(number, particle.bin)) continue;
                    if (!std::exchange(has_radii, true))
                        detail::radius_of<P>(set.view, slots, domain.cell_size).store(radii);
                    particle.radius = float(radii[lane]);
                    source.images.emplace_back(number, particle);
                }
        }
    }

    BlockNumbers numbers_;
    std::vector<Block> blocks_;
    std::vector<std::uint64_t> marked_;  // for each block, bits of the base nodes that are needed
    std::vector<Source> sources_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ranges_;  // (set, range)
};

}  // namespace firn::inline FIRN_BUILD
