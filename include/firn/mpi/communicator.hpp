/// \file A communicator of MPI: the ranks (processes) that run one simulation together, and what they tell each other.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>

#if !__has_include(<mpi.h>)
#error "firn/mpi needs MPI: in CMake link firn::mpi, not firn::firn; without CMake compile with mpicxx."
#include <firn::mpi is not linked>
#endif
#ifndef OMPI_SKIP_MPICXX
#define OMPI_SKIP_MPICXX 1  // the C++ bindings that MPI 3 removed are not used
#endif
#ifndef MPICH_SKIP_MPICXX
#define MPICH_SKIP_MPICXX 1
#endif
#include <mpi.h>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace firn::inline FIRN_BUILD::mpi {

/// A number that ranks can add up or compare.
template <class T>
concept number = std::same_as<T, double> || std::same_as<T, float> || std::same_as<T, std::int32_t> ||
                 std::same_as<T, std::int64_t> || std::same_as<T, std::uint32_t> || std::same_as<T, std::uint64_t>;

namespace detail {

template <number T>
MPI_Datatype datatype() {
    if constexpr (std::same_as<T, double>)
        return MPI_DOUBLE;
    else if constexpr (std::same_as<T, float>)
        return MPI_FLOAT;
    else if constexpr (std::same_as<T, std::int32_t>)
        return MPI_INT32_T;
    else if constexpr (std::same_as<T, std::int64_t>)
        return MPI_INT64_T;
    else if constexpr (std::same_as<T, std::uint32_t>)
        return MPI_UINT32_T;
    else
        return MPI_UINT64_T;
}

/// Checks that MPI runs.
/// \throws usage_error  if MPI was not initialised, or was finalised
inline void require_mpi() {
    int begun = 0, ended = 0;
    MPI_Initialized(&begun);
    if (begun) MPI_Finalized(&ended);
    if (!begun || ended)
        throw usage_error(
            "MPI does not run. Make a firn::mpi::Session in main() before the first simulation, and let it live longer "
            "than all simulations.");
}

}  // namespace detail

/// The ranks that run one simulation together. All functions except rank(), size() and get() are collective: every rank
/// must call them, in the same order.
///
/// An error of MPI ends the program: MPI's own handler prints it.
class Communicator {
public:
    /// Makes a duplicate of `of`, so that firn's messages never meet those of the program. Collective.
    /// \throws usage_error  if MPI does not run. \see Session
    explicit Communicator(MPI_Comm of) {
        detail::require_mpi();
        MPI_Comm made = MPI_COMM_NULL;
        MPI_Comm_dup(of, &made);
        held_ = std::shared_ptr<Held>(new Held{made}, [](Held* old) {
            int ended = 0;
            MPI_Finalized(&ended);
            if (!ended) MPI_Comm_free(&old->comm);
            delete old;
        });
        MPI_Comm_rank(made, &rank_);
        MPI_Comm_size(made, &size_);
    }
    /// Makes a duplicate of MPI_COMM_WORLD, the ranks of the whole program. Collective.
    /// \throws usage_error  if MPI does not run. \see Session
    Communicator() : Communicator((detail::require_mpi(), MPI_COMM_WORLD)) {}

    int rank() const { return rank_; }                  ///< Number of this rank, from 0.
    int size() const { return size_; }                  ///< Number of ranks.
    MPI_Comm get() const { return held_->comm; }        ///< The communicator, for calls of MPI.
    void barrier() const { MPI_Barrier(held_->comm); }  ///< Waits until all ranks have called barrier().

    /// Returns the sum of all ranks' numbers. If the numbers are not integers, rounding may depend on the number of
    /// ranks.
    template <number T>
    T sum(T mine) const {
        return reduced(mine, MPI_SUM);
    }
    /// Returns the largest of all ranks' numbers.
    template <number T>
    T max(T mine) const {
        return reduced(mine, MPI_MAX);
    }
    /// Returns the smallest of all ranks' numbers.
    template <number T>
    T min(T mine) const {
        return reduced(mine, MPI_MIN);
    }
    /// Replaces each of the numbers by the sum of all ranks' numbers at this place. All ranks give equally many.
    template <number T>
    void sum(std::span<T> numbers) const {
        reduce(numbers, MPI_SUM);
    }
    /// Replaces each of the numbers by the largest of all ranks' numbers at this place. All ranks give equally many.
    template <number T>
    void max(std::span<T> numbers) const {
        reduce(numbers, MPI_MAX);
    }
    /// Returns the sum of the numbers of all ranks below this one; 0 on rank 0.
    template <number T>
    T sum_before(T mine) const {
        T before = 0;
        MPI_Exscan(&mine, &before, 1, detail::datatype<T>(), MPI_SUM, held_->comm);
        return rank_ == 0 ? T(0) : before;
    }
    /// Returns the values of all ranks, in the order of the ranks.
    template <class T>
    std::vector<T> all(const T& mine) const {
        static_assert(std::is_trivially_copyable_v<T>);
        std::vector<T> values(std::size_t(size_), mine);
        MPI_Allgather(&mine, int(sizeof(T)), MPI_BYTE, values.data(), int(sizeof(T)), MPI_BYTE, held_->comm);
        return values;
    }
    /// Returns the text that one rank gives. The texts of the other ranks are ignored.
    std::string text_of(int rank, std::string text) const {
        std::uint64_t length = text.size();
        MPI_Bcast(&length, 1, MPI_UINT64_T, rank, held_->comm);
        text.resize(std::size_t(length));
        MPI_Bcast(text.data(), int(length), MPI_BYTE, rank, held_->comm);
        return text;
    }

    /// The tags of next_tag() are below this number.
    static constexpr int tags = 1 << 14;
    /// Returns a tag that no message of an earlier call has. Ranks that call the same collective functions get the same
    /// tags.
    int next_tag() const { return held_->last_tag = (held_->last_tag + 1) % tags; }

private:
    template <class T>
    T reduced(T mine, MPI_Op how) const {
        reduce(std::span<T>(&mine, 1), how);
        return mine;
    }
    template <class T>
    void reduce(std::span<T> numbers, MPI_Op how) const {
        constexpr std::size_t most = std::size_t(1) << 28;
        for (std::size_t at = 0; at < numbers.size(); at += most)
            MPI_Allreduce(MPI_IN_PLACE, numbers.data() + at, int(std::min(most, numbers.size() - at)),
                          detail::datatype<T>(), how, held_->comm);
    }

    struct Held {
        MPI_Comm comm;
        int last_tag = 0;
    };
    std::shared_ptr<Held> held_;  // shared by the copies of this object
    int rank_ = 0, size_ = 1;
};

/// Bytes that one rank sends to another.
struct Message {
    int rank = 0;                    ///< The rank that receives the message, or, once received, that has sent it.
    std::vector<std::byte> bytes{};  ///< The content.
};

/// Returns the content of a message as values of type T.
template <class T>
std::vector<T> contents(const Message& message) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<T> values(message.bytes.size() / sizeof(T));
    std::copy_n(message.bytes.data(), values.size() * sizeof(T), reinterpret_cast<std::byte*>(values.data()));
    return values;
}
/// Returns a message to a rank with these values.
template <class T>
Message message_of(int rank, const std::vector<T>& values) {
    const auto bytes = std::as_bytes(std::span(values));
    return {rank, {bytes.begin(), bytes.end()}};
}

/// Sends each of the messages to its rank, and returns the messages that this rank receives, in the order of the ranks
/// that sent them; messages of one rank come in the order in which it gave them. Collective.
///
/// No rank knows beforehand who sends to it. The cost grows with the number of messages and with log P: each rank sends
/// synchronously, and when all its messages have arrived, it enters a barrier that does not block; when all ranks have
/// entered it, no message is on its way (Hoefler, Siebert and Lumsdaine 2010, "Scalable communication protocols for
/// dynamic sparse data exchange", algorithm NBX).
inline std::vector<Message> exchange(const Communicator& all, std::vector<Message> outgoing) {
    constexpr std::size_t most = std::size_t(1) << 30;  // a longer message goes in pieces of this size
    const int tag = all.next_tag();
    std::vector<Message> received;
    const auto keep = [&](Message message) {
        const auto after = std::upper_bound(received.begin(), received.end(), message.rank,
                                            [](int rank, const Message& other) { return rank < other.rank; });
        received.insert(after, std::move(message));
    };
    std::vector<MPI_Request> sends;
    std::deque<std::uint64_t> lengths;  // of the messages to other ranks; a deque keeps its elements' addresses
    for (Message& message : outgoing) {
        if (message.rank == all.rank()) {
            keep(std::move(message));
            continue;
        }
        const auto send = [&](const void* data, std::size_t bytes) {
            sends.emplace_back();
            MPI_Issend(data, int(bytes), MPI_BYTE, message.rank, tag, all.get(), &sends.back());
        };
        if (message.bytes.size() > most || message.bytes.size() == sizeof(std::uint64_t)) {
            // Eight bytes announce how long the following message is.
            lengths.push_back(message.bytes.size());
            send(&lengths.back(), sizeof(std::uint64_t));
        }
        for (std::size_t at = 0; at == 0 || at < message.bytes.size(); at += most)
            send(message.bytes.data() + at, std::min(most, message.bytes.size() - at));
    }

    MPI_Request barrier = MPI_REQUEST_NULL;
    for (bool entered = false;;) {
        int is_there = 0;
        MPI_Status status;
        MPI_Iprobe(MPI_ANY_SOURCE, tag, all.get(), &is_there, &status);
        if (is_there) {
            const int from = status.MPI_SOURCE;
            const auto receive = [&](std::byte* to, std::size_t bytes) {
                MPI_Recv(to, int(bytes), MPI_BYTE, from, tag, all.get(), MPI_STATUS_IGNORE);
            };
            int count = 0;
            MPI_Get_count(&status, MPI_BYTE, &count);
            Message message{from, std::vector<std::byte>(std::size_t(count))};
            receive(message.bytes.data(), message.bytes.size());
            if (count == int(sizeof(std::uint64_t))) {
                std::uint64_t length = 0;
                std::memcpy(&length, message.bytes.data(), sizeof length);
                message.bytes.resize(std::size_t(length));
                for (std::size_t at = 0; at == 0 || at < message.bytes.size(); at += most)
                    receive(message.bytes.data() + at, std::min(most, message.bytes.size() - at));
            }
            keep(std::move(message));
            continue;
        }
        int done = 0;
        if (!entered) {
            MPI_Testall(int(sends.size()), sends.data(), &done, MPI_STATUSES_IGNORE);
            if (done) {
                MPI_Ibarrier(all.get(), &barrier);
                entered = true;
            }
        } else {
            MPI_Test(&barrier, &done, MPI_STATUS_IGNORE);
            if (done) break;
        }
    }
    return received;
}

}  // namespace firn::inline FIRN_BUILD::mpi
