/// \file Joins the sums of P2G at the nodes that several ranks share: pieces travel to the summing ranks, which add
/// them in order, and the sums travel back.
#pragma once

#include <firn/core/parallel.hpp>
#include <firn/data/box_masks.hpp>
#include <firn/data/particle_set.hpp>
#include <firn/loops/arena.hpp>
#include <firn/loops/mirror.hpp>
#include <firn/loops/places.hpp>
#include <firn/mpi/shared_blocks.hpp>
#include <firn/mpi/trace.hpp>

#include <atomic>
#include <bit>
#include <cstring>

namespace firn::inline FIRN_BUILD::mpi::detail {

/// Calls f(first, count) for each run of set bits of a mask.
template <class F>
void for_runs_of(std::uint64_t mask, const F& f) {
    while (mask != 0) {
        const int first = std::countr_zero(mask), count = std::countr_one(mask >> first);
        f(std::size_t(first), std::size_t(count));
        if (first + count >= 64) return;
        mask &= ~std::uint64_t(0) << (first + count);
    }
}

/// Memory for messages, which is kept from step to step.
struct MessageMemory {
    std::vector<std::byte> bytes{};
    MPI_Request request = MPI_REQUEST_NULL;

    std::byte* room(std::size_t count) {
        if (bytes.size() < count) bytes.resize(count + count / 8);
        return bytes.data();
    }
};

/// Memory of SharedSums that is kept from step to step.
struct SumsMemory {
    std::vector<std::uint64_t> masks{};  ///< for each piece of this rank, the nodes that its groups reach
    std::vector<MessageMemory> sent{}, received{}, returned{}, got{};
};

/// Joins the sums of one P2G over all ranks.
///
///     SharedSums<3> sums(…);
///     sums.mark<Kernel>(set, 0);           // for each set of particles: finds the nodes that its groups reach
///     sums.expect(values);                 // receives can begin
///     …                                    // scatter
///     sums.send(values, 0);                // the pieces of a batch travel
///     sums.add(values);                    // adds pieces in order, on the summing ranks
///     sums.send_back(values);              // the sums travel back to all that contribute
template <int D>
class SharedSums {
public:
    SharedSums(const Communicator& all, SharedBlocks<D>& shared, SumsMemory& memory,
               const std::vector<MirrorPlane>& mirrors, int threads, Trace* trace)
        : all_(all), shared_(shared), memory_(memory), mirrors_(mirrors), threads_(threads), trace_(trace) {
        memory_.sent.resize(shared.outgoing().size());
        memory_.received.resize(shared.incoming().size());
        memory_.returned.resize(shared.to_return().size());
        memory_.got.resize(shared.to_get().size());
        offsets_.resize(shared.incoming().size());
    }

    /// Finds the nodes of this rank's pieces that the groups of a set reach. Call it for all sets before scattering.
    /// \param grid      the grid to which P2G scatters: a GridOfPieces, or, for sums in integers, a SparseGrid
    template <class Kernel, class View, class Grid>
    void mark(const ParticleSet<View>& set, std::size_t material, const Grid& grid) {
        const Phase phase(trace_, "find reached nodes");
        if (material == 0) memory_.masks.assign(shared_.pieces().size(), 0);
        const Positions<View> positions(grid.domain());
        const std::vector<std::uint32_t>& groups = shared_.boundary_groups(material);
        parallel_for(
            groups.size(), threads_,
            [&](std::size_t i, int) {
                const BlockGroup& group = set.partition.groups[groups[i]];
                const GroupPlaces<View> places(set.view, set.partition, group, positions);
                mark(places.template box<Kernel>(group), BlocksAround<D>(grid, set.partition, group),
                     group.sparse ? cube_blocks + 2 : 3);
            },
            4);
    }
    /// Marks all nodes beside mirrored walls. Call it after mark().
    ///
    /// A node beside such a wall depends on the node on the other side, and at an edge on those behind both walls. A
    /// rank needs them all, for its particles and for the reactions that it counts.
    /// \param grid  the grid of this rank's blocks
    template <std::floating_point S>
    void mark_mirrored(const SparseGrid<S, D>& grid) {
        for (const MirrorPlane& plane : mirrors_)
            for (std::size_t i = 0; i < shared_.pieces().size(); ++i) {
                const int block = grid.block_along(shared_.pieces()[i].block, plane.axis);
                unsigned sets[D];
                std::fill(std::begin(sets), std::end(sets), 15u);
                sets[plane.axis] = 0;
                for (int node = plane.node - 1; node <= plane.node + 1; ++node)
                    if (node >> 2 == block) sets[plane.axis] |= 1u << (node & 3);
                if (sets[plane.axis] != 0) memory_.masks[i] |= firn::detail::BoxMasks<D>::mask(sets);
            }
    }

    /// Sets the values of the pieces that mark() has found to zero, in whole rows of nodes.
    template <class T>
    void clear(T* values) const {
        constexpr std::size_t row = std::size_t(block_size * node_width);
        parallel_for(
            shared_.blocks_behind(), threads_,
            [&](std::size_t i, int) {
                T* const block = values + shared_.storage(i) * numbers<node_width>;
                for (std::size_t r = 0; r < std::size_t(block_nodes<D> / block_size); ++r)
                    if (memory_.masks[i] >> (block_size * r) & 15) std::fill_n(block + r * row, row, T(0));
            },
            64);
    }

    /// Begins to receive the pieces of other ranks.
    /// \tparam Width  number of values of a node
    template <int Width, class T>
    void expect(const T*) {
        for (std::size_t m = 0; m < shared_.incoming().size(); ++m) {
            const PieceMessage& message = shared_.incoming()[m];
            MessageMemory& memory = memory_.received[m];
            const std::size_t most = message.pieces.size() * (sizeof(std::uint64_t) + numbers<Width> * sizeof(T));
            MPI_Irecv(memory.room(most), int(most), MPI_BYTE, message.rank, tag_of_pieces + message.batch, all_.get(),
                      &memory.request);
        }
    }

    /// Sends the pieces of a batch: for each piece its mask, then the values of the nodes in the masks.
    template <int Width, class T>
    void send(const T* values, int batch) {
        const Phase phase(trace_, batch == 0 ? "send first half" : "send second half");
        for (std::size_t m = 0; m < shared_.outgoing().size(); ++m) {
            const PieceMessage& message = shared_.outgoing()[m];
            if (message.batch != batch) continue;
            const std::size_t count = message.pieces.size();
            const std::uint64_t* const masks = memory_.masks.data() + message.first;
            const std::size_t bytes = pack<Width, T>(memory_.sent[m], count, masks, masks, count, [&](std::size_t i) {
                return values + shared_.storage(message.first + i) * numbers<Width>;
            });
            post(memory_.sent[m], bytes, message.rank, tag_of_pieces + batch);
        }
    }

    /// Waits for the pieces of other ranks, and adds all pieces of the blocks that this rank sums, in order.
    template <int Width, class T>
    void add(T* values) {
        wait_for_pieces();
        const Phase phase(trace_, "add pieces");
        for (std::size_t m = 0; m < shared_.incoming().size(); ++m)
            find_offsets(received_masks(m), shared_.incoming()[m].pieces.size(), offsets_[m]);
        parallel_for(
            shared_.summed_blocks().size(), threads_,
            [&](std::size_t b, int) {
                T* const to = values + shared_.summed_blocks()[b] * numbers<Width>;
                for (const PieceOfMessage& of : shared_.sums()[b]) {
                    if (of.message == shared_.own()) {
                        const T* const from = values + shared_.storage(of.piece) * numbers<Width>;
                        for_runs_of(memory_.masks[of.piece], [&](std::size_t first, std::size_t count) {
                            for (std::size_t i = first * Width; i < (first + count) * Width; ++i) to[i] += from[i];
                        });
                    } else {
                        const std::uint64_t mask = received_masks(of.message)[of.piece];
                        const T* from = received_values<T>(of.message) + offsets_[of.message][of.piece] * Width;
                        for_runs_of(mask, [&](std::size_t first, std::size_t count) {
                            for (std::size_t i = 0; i < count * Width; ++i) to[first * Width + i] += from[i];
                            from += count * Width;
                        });
                    }
                }
            },
            16);
    }

    /// Sends the sums to the ranks that contribute to them, and receives those that other ranks have formed.
    template <int Width, class T>
    void send_back(T* values) {
        std::vector<MPI_Request> gets;
        for (std::size_t r = 0; r < shared_.to_get().size(); ++r) {
            ReturnedBlocks& one = shared_.to_get()[r];
            join_masks(one);
            const std::size_t bytes = nodes_of(one.masks) * Width * sizeof(T);
            gets.emplace_back();
            MPI_Irecv(memory_.got[r].room(bytes), int(bytes), MPI_BYTE, one.rank, tag_of_sums, all_.get(),
                      &gets.back());
        }
        {
            const Phase phase(trace_, "send sums back");
            for (std::size_t r = 0; r < shared_.to_return().size(); ++r) {
                ReturnedBlocks& one = shared_.to_return()[r];
                join_masks(one);
                const std::size_t bytes =
                    pack<Width, T>(memory_.returned[r], one.blocks.size(), one.masks.data(), nullptr, 0,
                                   [&](std::size_t i) { return values + one.blocks[i] * numbers<Width>; });
                post(memory_.returned[r], bytes, one.rank, tag_of_sums);
            }
        }
        for (std::size_t left = gets.size(); left > 0; --left) {
            int r = 0;
            {
                const Phase phase(trace_, "wait for sums", true);
                MPI_Waitany(int(gets.size()), gets.data(), &r, MPI_STATUS_IGNORE);
            }
            const Phase phase(trace_, "take sums");
            const ReturnedBlocks& one = shared_.to_get()[std::size_t(r)];
            const T* const from = reinterpret_cast<const T*>(memory_.got[std::size_t(r)].bytes.data());
            find_offsets(one.masks.data(), one.masks.size(), offsets_of_got_);
            parallel_for(
                one.blocks.size(), threads_,
                [&](std::size_t i, int) {
                    const T* at = from + offsets_of_got_[i] * Width;
                    T* const to = values + one.blocks[i] * numbers<Width>;
                    for_runs_of(one.masks[i], [&](std::size_t first, std::size_t count) {
                        std::copy_n(at, count * Width, to + first * Width);
                        at += count * Width;
                    });
                },
                64);
        }
        const Phase phase(trace_, "wait for sends", true);
        for (auto* const messages : {&memory_.sent, &memory_.returned})
            for (MessageMemory& message : *messages) MPI_Wait(&message.request, MPI_STATUS_IGNORE);
    }
    /// Waits until all messages of send() have left; for sums that do not travel back.
    void finish_sends() {
        const Phase phase(trace_, "wait for sends", true);
        for (MessageMemory& message : memory_.sent) MPI_Wait(&message.request, MPI_STATUS_IGNORE);
    }

private:
    static constexpr int tag_of_pieces = Communicator::tags, tag_of_sums = Communicator::tags + 2;
    /// Number of values of a block.
    template <int Width>
    static constexpr std::size_t numbers = std::size_t(block_nodes<D> * Width);

    /// Adds the nodes of a box to the masks of the pieces in which they lie.
    /// \param blocks  number of blocks along each axis of the arena
    void mark(const ArenaBox<D>& box, const BlocksAround<D>& around, int blocks) {
        constexpr int before = block_size - allowed_drift;  // index of the arena's first node within its block
        unsigned sets[D][cube_blocks + 2];
        for (int a = 0; a < D; ++a)
            for (int j = 0; j < blocks; ++j) {
                const int first = std::max(box.first[a] + before - block_size * j, 0),
                          last = std::min(box.last[a] + before - block_size * j, block_size - 1);
                sets[a][j] = first > last ? 0 : (2u << last) - (1u << first);
            }
        int index = 0;
        const auto look = [&](const unsigned(&of_block)[D]) {
            const std::uint32_t block = around.data()[index++];
            if (block == no_block) return;
            const std::uint32_t piece = shared_.piece_in(block);
            if (piece == SharedBlocks<D>::none) return;
            const std::uint64_t mask = firn::detail::BoxMasks<D>::mask(of_block);
            if (mask != 0) std::atomic_ref(memory_.masks[piece]).fetch_or(mask, std::memory_order_relaxed);
        };
        for (int i = 0; i < blocks; ++i)
            for (int j = 0; j < blocks; ++j) {
                if constexpr (D == 2)
                    look({sets[0][i], sets[1][j]});
                else
                    for (int k = 0; k < blocks; ++k) look({sets[0][i], sets[1][j], sets[2][k]});
            }
    }

    /// Writes a message: `header` (a list of masks, or nothing), then the values of the nodes in the masks.
    /// \param block_of  block_of(i) returns the address of the values of block i
    /// \return the size of the message [bytes]
    template <int Width, class T, class BlockOf>
    std::size_t pack(MessageMemory& memory, std::size_t count, const std::uint64_t* masks, const std::uint64_t* header,
                     std::size_t in_header, const BlockOf& block_of) {
        const std::size_t nodes = find_offsets(masks, count, offsets_of_pack_);
        const std::size_t begin = in_header * sizeof(std::uint64_t), bytes = begin + nodes * Width * sizeof(T);
        std::byte* const message = memory.room(bytes);
        if (in_header > 0) std::memcpy(message, header, begin);
        T* const first_value = reinterpret_cast<T*>(message + begin);
        parallel_for(
            count, threads_,
            [&](std::size_t i, int) {
                T* to = first_value + offsets_of_pack_[i] * Width;
                const T* const from = block_of(i);
                for_runs_of(masks[i], [&](std::size_t first, std::size_t run) {
                    to = std::copy_n(from + first * Width, run * Width, to);
                });
            },
            64);
        return bytes;
    }
    void post(MessageMemory& memory, std::size_t bytes, int rank, int tag) {
        if (trace_) trace_->bytes_sent += bytes, ++trace_->messages_sent;
        MPI_Isend(memory.bytes.data(), int(bytes), MPI_BYTE, rank, tag, all_.get(), &memory.request);
    }
    void wait_for_pieces() {
        const Phase phase(trace_, "wait for pieces", true);
        for (MessageMemory& message : memory_.received) MPI_Wait(&message.request, MPI_STATUS_IGNORE);
    }

    /// For each mask, finds how many nodes the masks before it have. Returns how many nodes all have.
    static std::size_t find_offsets(const std::uint64_t* masks, std::size_t count, std::vector<std::size_t>& offsets) {
        offsets.resize(count);
        std::size_t nodes = 0;
        for (std::size_t i = 0; i < count; ++i) {
            offsets[i] = nodes;
            nodes += std::size_t(std::popcount(masks[i]));
        }
        return nodes;
    }
    static std::size_t nodes_of(const std::vector<std::uint64_t>& masks) {
        std::size_t nodes = 0;
        for (const std::uint64_t mask : masks) nodes += std::size_t(std::popcount(mask));
        return nodes;
    }
    void join_masks(ReturnedBlocks& one) const {
        for (std::size_t i = 0; i < one.blocks.size(); ++i) {
            one.masks[i] = 0;
            for (const PieceOfMessage& of : one.pieces[i])
                one.masks[i] |=
                    of.message == shared_.own() ? memory_.masks[of.piece] : received_masks(of.message)[of.piece];
        }
    }
    const std::uint64_t* received_masks(std::size_t message) const {
        return reinterpret_cast<const std::uint64_t*>(memory_.received[message].bytes.data());
    }
    template <class T>
    const T* received_values(std::size_t message) const {
        return reinterpret_cast<const T*>(received_masks(message) + shared_.incoming()[message].pieces.size());
    }

    const Communicator& all_;
    SharedBlocks<D>& shared_;
    SumsMemory& memory_;
    const std::vector<MirrorPlane>& mirrors_;
    int threads_;
    Trace* trace_;
    std::vector<std::vector<std::size_t>> offsets_;  // of the pieces in each received message
    std::vector<std::size_t> offsets_of_pack_, offsets_of_got_;
};

}  // namespace firn::inline FIRN_BUILD::mpi::detail
