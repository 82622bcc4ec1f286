/// \file Contact where particles are on different ranks, between groups and with boundaries that act by the gap: which
/// blocks of the domain several ranks have copies of, and what they tell each other.
///
/// The copies of a block for different groups are owned by any ranks. Every rank that has one of them lets all groups
/// meet there, so all of these ranks need all groups' sums and the particles around. A node then gets the same bits on
/// all ranks, as contact does not depend on the order in which particles are found.
#pragma once

#include <firn/data/sparse_grid.hpp>
#include <firn/loops/execution.hpp>
#include <firn/mpi/communicator.hpp>
#include <firn/mpi/cuts.hpp>
#include <firn/mpi/shared_blocks.hpp>

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi::detail {

/// The blocks of the domain of which several ranks have copies, since the last sort.
template <int D>
class SharedCopies {
public:
    SharedCopies() = default;
    /// Finds them. Collective.
    /// \param cuts         which rank owns which cubes; it decides which rank has the sums of a block
    /// \param first_block  index of the first block behind the grid that may hold the sums of a copy
    /// \param acts_by_gap  whether ranks also tell each other the particles near blocks of which there is one copy, for
    ///                     a boundary. \see GapContact
    template <std::floating_point S>
    SharedCopies(const Communicator& all, const SparseGrid<S, D>& grid, const Cuts<D>& cuts, std::size_t first_block,
                 bool acts_by_gap)
        : domain_(grid.domain()) {
        elsewhere_.first_block = first_block;
        std::vector<Holder> holders = holders_of_places(all, grid, acts_by_gap);
        std::sort(holders.begin(), holders.end());
        for (std::size_t first = 0, last = 0; first < holders.size(); first = last) {
            while (last < holders.size() && holders[last].place == holders[first].place) ++last;
            add_place(all.rank(), grid, cuts, std::span(holders).subspan(first, last - first));
        }
        for (Partner& partner : partners_) {
            std::ranges::sort(partner.near);
            partner.near.erase(std::unique(partner.near.begin(), partner.near.end()), partner.near.end());
        }
    }

    const CopiesElsewhere& elsewhere() const { return elsewhere_; }  ///< The copies that only other ranks have.

    /// Completes the sums in the copies of shared blocks. Collective.
    template <std::floating_point S>
    void bring_sums(const Communicator& all, SparseGrid<S, D>& grid) {
        constexpr std::size_t numbers = std::size_t(block_nodes<D> * node_width);
        for (Partner& partner : partners_) {
            partner.out.resize(partner.sent.size() * numbers * sizeof(S));
            for (std::size_t i = 0; i < partner.sent.size(); ++i)
                std::memcpy(partner.out.data() + i * numbers * sizeof(S), grid.nodes(partner.sent[i]),
                            numbers * sizeof(S));
        }
        send_to_partners(all);
        for (const Partner& partner : partners_)
            for (std::size_t i = 0; i < partner.received.size(); ++i)
                std::memcpy(grid.nodes(partner.received[i]), partner.in.data() + i * numbers * sizeof(S),
                            numbers * sizeof(S));
    }

    /// Sends this rank's particles near contact to the ranks that need them, and takes theirs. Collective.
    /// \param near  a NearParticles
    template <class Near>
    void bring_particles(const Communicator& all, Near& near) {
        using Particle = typename Near::Particle;
        for (Partner& partner : partners_) {
            partner.out.clear();
            const auto append = [&](const void* from, std::size_t bytes) {
                const auto* const begin = static_cast<const std::byte*>(from);
                partner.out.insert(partner.out.end(), begin, begin + bytes);
            };
            for (const std::uint64_t key : partner.near) {
                const std::uint32_t number = near.find(key);
                if (!near.is_marked(number) || near.found(number).empty()) continue;
                const std::uint64_t count = near.found(number).size();
                append(&key, sizeof key);
                append(&count, sizeof count);
                append(near.found(number).data(), count * sizeof(Particle));
            }
        }
        send_to_partners(all);
        for (const Partner& partner : partners_)
            for (std::size_t at = 0; at < partner.in.size();) {
                std::uint64_t head[2];
                std::memcpy(head, partner.in.data() + at, sizeof head);
                at += sizeof head;
                if (const std::uint32_t number = near.find(head[0]); near.is_marked(number)) {
                    auto& found = near.found(number);
                    const std::size_t before = found.size();
                    found.resize(before + head[1]);
                    std::memcpy(found.data() + before, partner.in.data() + at, head[1] * sizeof(Particle));
                }
                at += head[1] * sizeof(Particle);
            }
    }

private:
    /// A rank that has a copy of a block of the domain.
    struct Holder {
        std::uint64_t place, key;  // keys of the block and of the copy
        std::int64_t rank;
        auto operator<=>(const Holder&) const = default;
    };
    /// A rank with which this rank shares blocks.
    struct Partner {
        int rank;
        std::vector<std::size_t> sent{}, received{};  // indices of blocks whose sums travel
        std::vector<std::uint64_t> near{};            // keys of the blocks whose particles are sent
        std::vector<std::byte> out{}, in{};
    };

    /// Returns the holders of all copies of those blocks of the domain of which this rank has a copy, and of which
    /// there are several copies (or, with acts_by_gap, one) on several ranks. Each block has a rank that is told who
    /// holds copies of it.
    template <std::floating_point S>
    std::vector<Holder> holders_of_places(const Communicator& all, const SparseGrid<S, D>& grid,
                                          bool acts_by_gap) const {
        const std::size_t ranks = std::size_t(all.size());
        std::vector<std::vector<std::uint64_t>> told(ranks);
        for (std::size_t b = 0; b < grid.block_count(); ++b) {
            const std::uint64_t key = block_key<D>(grid.block(b)), place = key_in_domain(domain_, key);
            told[std::size_t((place * 0x9e3779b97f4a7c15ull) >> 32) % ranks].push_back(key);
        }
        std::vector<Holder> holders;
        for (const Message& message : exchange(all, messages(told)))
            for (const std::uint64_t key : contents<std::uint64_t>(message))
                holders.push_back({key_in_domain(domain_, key), key, message.rank});
        std::sort(holders.begin(), holders.end());
        std::vector<std::vector<Holder>> answers(ranks);
        for (std::size_t first = 0, last = 0; first < holders.size(); first = last) {
            bool several_copies = false, several_ranks = false;
            for (; last < holders.size() && holders[last].place == holders[first].place; ++last) {
                several_copies = several_copies || holders[last].key != holders[first].key;
                several_ranks = several_ranks || holders[last].rank != holders[first].rank;
            }
            if (!several_ranks || !(several_copies || acts_by_gap)) continue;
            std::vector<std::int64_t> to;
            for (std::size_t i = first; i < last; ++i) to.push_back(holders[i].rank);
            std::ranges::sort(to);
            to.erase(std::unique(to.begin(), to.end()), to.end());
            for (const std::int64_t rank : to) {
                auto& answer = answers[std::size_t(rank)];
                answer.insert(answer.end(), holders.begin() + std::ptrdiff_t(first),
                              holders.begin() + std::ptrdiff_t(last));
            }
        }
        holders.clear();
        for (const Message& message : exchange(all, messages(answers)))
            for (const Holder& holder : contents<Holder>(message)) holders.push_back(holder);
        return holders;
    }

    /// Finds what travels for one block of the domain. \param holders  the holders of its copies, sorted by key
    template <std::floating_point S>
    void add_place(int me, const SparseGrid<S, D>& grid, const Cuts<D>& cuts, std::span<const Holder> holders) {
        std::vector<int> ranks;
        for (const Holder& holder : holders) ranks.push_back(int(holder.rank));
        std::ranges::sort(ranks);
        ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
        const bool may_meet = holders.front().key != holders.back().key;
        for (std::size_t first = 0, last = 0; first < holders.size(); first = last) {
            const std::uint64_t key = holders[first].key;
            while (last < holders.size() && holders[last].key == key) ++last;
            SummingRank summing(cuts.owner(block_of_key<D>(key)));
            bool is_mine = false;
            for (std::size_t i = first; i < last; ++i) {
                summing.add(int(holders[i].rank));
                is_mine = is_mine || holders[i].rank == me;
            }
            std::size_t block = grid.find(block_of_key<D>(key));
            if (block == no_block) {
                block = elsewhere_.first_block + elsewhere_.keys.size();
                elsewhere_.keys.push_back(key);
            }
            for (const int rank : ranks) {
                if (rank == me) continue;
                if (may_meet && summing.rank() == me) partner(rank).sent.push_back(block);
                if (may_meet && summing.rank() == rank) partner(rank).received.push_back(block);
                if (is_mine)
                    for (int k = 0; k < 1 << D; ++k)
                        partner(rank).near.push_back(
                            block_key<D>(wrapped(domain_, block_before<D>(block_of_key<D>(key), k))));
            }
        }
    }
    Partner& partner(int rank) {
        const auto found = std::ranges::lower_bound(partners_, rank, {}, &Partner::rank);
        if (found != partners_.end() && found->rank == rank) return *found;
        return *partners_.insert(found, Partner{rank});
    }

    /// Sends `out` of each partner to it, and receives `in` from it.
    void send_to_partners(const Communicator& all) {
        const int tag = all.next_tag();
        std::vector<MPI_Request> sends(partners_.size());
        for (std::size_t i = 0; i < partners_.size(); ++i)
            MPI_Isend(partners_[i].out.data(), length(partners_[i].out.size()), MPI_BYTE, partners_[i].rank, tag,
                      all.get(), &sends[i]);
        for (Partner& partner : partners_) {
            MPI_Status status;
            MPI_Probe(partner.rank, tag, all.get(), &status);
            int bytes = 0;
            MPI_Get_count(&status, MPI_BYTE, &bytes);
            partner.in.resize(std::size_t(bytes));
            MPI_Recv(partner.in.data(), bytes, MPI_BYTE, partner.rank, tag, all.get(), MPI_STATUS_IGNORE);
        }
        MPI_Waitall(int(sends.size()), sends.data(), MPI_STATUSES_IGNORE);
    }
    static int length(std::size_t bytes) {
        if (bytes > std::size_t(std::numeric_limits<int>::max()))
            throw memory_error(sentence("The contact between two ranks needs a message of ", bytes,
                                        " bytes, more than MPI can send at once. Use more ranks."));
        return int(bytes);
    }

    template <class T>
    static std::vector<Message> messages(const std::vector<std::vector<T>>& to_ranks) {
        std::vector<Message> outgoing;
        for (std::size_t rank = 0; rank < to_ranks.size(); ++rank) {
            if (!to_ranks[rank].empty()) outgoing.push_back(message_of(int(rank), to_ranks[rank]));
        }
        return outgoing;
    }
    Domain<D> domain_{};
    CopiesElsewhere elsewhere_;
    std::vector<Partner> partners_;  // sorted by rank
};

}  // namespace firn::inline FIRN_BUILD::mpi::detail
