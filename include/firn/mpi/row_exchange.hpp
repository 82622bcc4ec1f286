/// \file Moves the rows of arrays between ranks: each array of a state is moved in the same way, one after the other.
#pragma once

#include <firn/core/error.hpp>
#include <firn/io/state_reader-inl.hpp>
#include <firn/mpi/communicator.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi::detail {

using firn::detail::RowsPart;

/// Rows that this rank sends to another rank, or receives from it.
struct RowsOfRank {
    int rank;
    std::size_t first, count;  ///< the rows: consecutive among those that are sent, or among those that are received
};

/// Sends a text of bytes of any length in messages that MPI can count.
/// \param call  call(address, number of bytes), for each message
template <class Byte, class Call>
void in_messages(Byte* bytes, std::size_t count, const Call& call) {
    constexpr std::size_t most = std::size_t(1) << 30;
    for (std::size_t at = 0; at < count; at += most) call(bytes + at, int(std::min(most, count - at)));
}

/// A plan by which rows of arrays go to other ranks. Rows that stay are moved without a message.
class RowExchange {
public:
    /// Makes a plan. Collective.
    /// \param owners  for each rank to which this rank sends, its rows; all rows of this rank, in their order
    RowExchange(const Communicator& all, std::vector<RowsOfRank> outgoing) : all_(all), outgoing_(std::move(outgoing)) {
        std::vector<Message> counts;
        for (const RowsOfRank& rows : outgoing_) {
            counts.push_back({rows.rank, std::vector<std::byte>(sizeof(std::uint64_t))});
            const std::uint64_t count = rows.count;
            std::memcpy(counts.back().bytes.data(), &count, sizeof count);
        }
        for (const Message& message : exchange(all, std::move(counts))) {
            std::uint64_t count = 0;
            std::memcpy(&count, message.bytes.data(), sizeof count);
            incoming_.push_back({message.rank, received_, std::size_t(count)});
            received_ += std::size_t(count);
        }
    }

    /// Number of rows that this rank receives, including those that stay.
    std::size_t received() const { return received_; }
    /// What is received from which rank, in the order of the ranks.
    const std::vector<RowsOfRank>& incoming() const { return incoming_; }

    /// Sends on their way.
    class Sends {
    public:
        Sends() = default;
        Sends(const Sends&) = delete;
        Sends& operator=(const Sends&) = delete;
        /// Waits, too, unless an error is on its way: other ranks may not receive what was sent then.
        ~Sends() {
            if (std::uncaught_exceptions() == errors_before_) finish();
        }
        /// Waits until the rows were sent, so that their memory may be changed.
        void finish() {
            MPI_Waitall(int(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
            requests_.clear();
        }

    private:
        friend class RowExchange;
        std::vector<MPI_Request> requests_{};
        int errors_before_ = std::uncaught_exceptions();
    };

    /// Begins to send the rows of an array. The array must not change before sends.finish() has returned.
    /// \param tag  the tag of the messages: a new one for each array, the same on all ranks. \see next_tag()
    template <class T>
    void send(std::span<const T> rows, std::size_t columns, int tag, Sends& sends) const {
        for (const RowsOfRank& to : outgoing_) {
            if (to.rank == all_.rank()) continue;
            in_messages(reinterpret_cast<const std::byte*>(rows.data() + to.first * columns),
                        to.count * columns * sizeof(T), [&](const std::byte* bytes, int count) {
                            sends.requests_.emplace_back();
                            MPI_Isend(bytes, count, MPI_BYTE, to.rank, tag, all_.get(), &sends.requests_.back());
                        });
        }
    }
    /// Returns the rows of an array that all ranks have begun to send to this rank, in the order of the ranks.
    /// \param rows  this rank's rows of the array, of which those that stay are copied
    template <class T>
    std::vector<T> receive(std::span<const T> rows, std::size_t columns, int tag) const {
        std::vector<T> here(received_ * columns);
        std::vector<MPI_Request> requests;
        for (const RowsOfRank& from : incoming_) {
            if (from.rank == all_.rank()) continue;
            in_messages(reinterpret_cast<std::byte*>(here.data() + from.first * columns),
                        from.count * columns * sizeof(T), [&](std::byte* bytes, int count) {
                            requests.emplace_back();
                            MPI_Irecv(bytes, count, MPI_BYTE, from.rank, tag, all_.get(), &requests.back());
                        });
        }
        for (const RowsOfRank& from : incoming_) {
            if (from.rank != all_.rank()) continue;
            for (const RowsOfRank& to : outgoing_)
                if (to.rank == all_.rank())
                    std::copy_n(rows.data() + to.first * columns, to.count * columns,
                                here.data() + from.first * columns);
        }
        MPI_Waitall(int(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
        return here;
    }
    /// Sends and receives the rows of an array. Collective.
    template <class T>
    std::vector<T> move(std::span<const T> rows, std::size_t columns) const {
        const int tag = all_.next_tag();
        Sends sends;
        send(rows, columns, tag, sends);
        return receive(rows, columns, tag);
    }

private:
    const Communicator& all_;
    std::vector<RowsOfRank> outgoing_, incoming_;
    std::size_t received_ = 0;
};

/// Returns an id as an unsigned number with the same order.
inline std::uint64_t ordered_bits(std::int64_t id) { return std::uint64_t(id) ^ std::uint64_t(1) << 63; }

/// Returns, for each rank, the rows with those ids that belong to the rank when ids are shared out evenly: rank r gets
/// the r-th part (see RowsPart) of all ids in ascending order. Collective.
/// \param ids  the ids of this rank's rows, ascending; all ids of all ranks differ
inline std::vector<RowsOfRank> even_shares(const Communicator& all, const std::vector<std::int64_t>& ids) {
    const auto ranks = std::size_t(all.size());
    const std::uint64_t whole = all.sum(std::uint64_t(ids.size()));
    // last[r]: the highest id of rank r, found by bisection: so many ids are at most as high as that of the last row.
    std::vector<std::uint64_t> last(ranks), high(ranks), below(ranks);
    constexpr std::uint64_t none = ~std::uint64_t(0);
    const std::uint64_t lowest = all.min(ids.empty() ? none : ordered_bits(ids.front()));
    const std::uint64_t highest = all.max(ids.empty() ? std::uint64_t(0) : ordered_bits(ids.back()));
    std::fill(last.begin(), last.end(), lowest);
    std::fill(high.begin(), high.end(), highest);
    const auto count_to = [&](std::uint64_t bound) {
        return std::size_t(std::upper_bound(ids.begin(), ids.end(), bound,
                                            [](std::uint64_t b, std::int64_t id) { return b < ordered_bits(id); }) -
                           ids.begin());
    };
    for (int bit = whole == 0 ? 0 : int(std::bit_width(highest - lowest)); bit > 0; --bit) {
        for (std::size_t r = 0; r < ranks; ++r) below[r] = count_to(last[r] + (high[r] - last[r]) / 2);
        all.sum(std::span<std::uint64_t>(below));
        for (std::size_t r = 0; r < ranks; ++r) {
            if (last[r] == high[r]) continue;
            const std::uint64_t middle = last[r] + (high[r] - last[r]) / 2;
            const RowsPart part{r, ranks};
            if (below[r] >= part.first(whole) + part.count(whole))
                high[r] = middle;
            else
                last[r] = middle + 1;
        }
    }
    std::vector<RowsOfRank> shares;
    std::size_t first = 0;
    for (std::size_t r = 0; r < ranks; ++r) {
        const RowsPart part{r, ranks};
        const std::size_t end = r + 1 == ranks ? ids.size() : part.count(whole) == 0 ? first : count_to(last[r]);
        if (end > first) shares.push_back({int(r), first, end - first});
        first = std::max(first, end);
    }
    return shares;
}

/// Returns the order in which the rows that a RowExchange has received have ascending ids: the k-th row is row order[k]
/// of those received. Returns nothing if they are in this order already.
/// \param incoming  what came from which rank; the ids of each rank are ascending
inline std::vector<std::uint32_t> order_of_ids(const std::vector<std::int64_t>& ids,
                                               const std::vector<RowsOfRank>& incoming) {
    if (std::is_sorted(ids.begin(), ids.end())) return {};
    std::vector<std::uint32_t> order(ids.size()), merged(ids.size());
    std::iota(order.begin(), order.end(), std::uint32_t(0));
    std::vector<std::size_t> ends;
    for (const RowsOfRank& rows : incoming) ends.push_back(rows.first + rows.count);
    const auto lower = [&](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; };
    while (ends.size() > 1) {  // merges neighbours
        std::vector<std::size_t> fewer;
        std::size_t first = 0;
        for (std::size_t i = 0; i < ends.size(); i += 2) {
            const std::size_t middle = ends[i], end = ends[std::min(i + 1, ends.size() - 1)];
            const auto at = [&](std::size_t k) { return order.begin() + std::ptrdiff_t(k); };
            std::merge(at(first), at(middle), at(middle), at(end), merged.begin() + std::ptrdiff_t(first), lower);
            fewer.push_back(end);
            first = end;
        }
        order.swap(merged);
        ends = std::move(fewer);
    }
    return order;
}

/// Returns rows in another order: the k-th row is row order[k] of before.
/// \param order  the order; if it is empty, the rows are returned as they are
template <class T>
std::vector<T> in_order(std::vector<T>&& rows, std::size_t columns, const std::vector<std::uint32_t>& order) {
    if (order.empty()) return std::move(rows);
    std::vector<T> moved(rows.size());
    for (std::size_t k = 0; k < order.size(); ++k)
        std::copy_n(rows.data() + order[k] * columns, columns, moved.data() + k * columns);
    return moved;
}

}  // namespace firn::inline FIRN_BUILD::mpi::detail
