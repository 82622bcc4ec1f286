// ranks: 1 4 7
// more_ranks: 2 3
// threads: 1
/// \file What ranks tell each other: sums, gathered values, texts, and messages that only their sender knows of.
#include "support/catch.hpp"
#include <firn/mpi/communicator.hpp>

#include <chrono>
#include <random>
#include <thread>

namespace {

using firn::mpi::Communicator;
using firn::mpi::Message;

template <class T>
void check_reductions(const Communicator& ranks) {
    const int rank = ranks.rank(), size = ranks.size();
    CHECK(ranks.sum(T(rank + 1)) == T(size * (size + 1) / 2));
    CHECK(ranks.max(T(10 * rank + 3)) == T(10 * (size - 1) + 3));
    CHECK(ranks.min(T(10 * rank + 3)) == T(3));
    CHECK(ranks.sum_before(T(rank + 1)) == T(rank * (rank + 1) / 2));

    std::vector<T> numbers, sums, largest;
    for (int i = 0; i < 1000; ++i) {
        numbers.push_back(T((rank * 7 + i * 3) % 11));
        T sum = 0, most = 0;
        for (int other = 0; other < size; ++other) {
            const T number = T((other * 7 + i * 3) % 11);
            sum += number;
            most = std::max(most, number);
        }
        sums.push_back(sum);
        largest.push_back(most);
    }
    auto summed = numbers, compared = numbers;
    ranks.sum(std::span<T>(summed));
    ranks.max(std::span<T>(compared));
    CHECK(summed == sums);
    CHECK(compared == largest);
    ranks.sum(std::span<T>());
}

/// What rank `from` sends in a round; every rank can tell. A few of the messages are large, empty, or of eight bytes.
std::vector<Message> messages(int from, int size, unsigned round) {
    std::mt19937 random(round * 1000 + unsigned(from));
    std::vector<Message> list;
    if (round % 5 == 4 && from != int(round) % size) return list;  // one rank speaks alone
    const auto count = random() % 8;
    for (unsigned k = 0; k < count; ++k) {
        const std::size_t lengths[] = {0, 1, 8, 8, 100, 5000, 70'000, 300'000};
        Message message{int(random() % unsigned(size)), std::vector<std::byte>(lengths[random() % 8])};
        auto word = std::uint32_t(random());
        for (std::byte& byte : message.bytes) byte = std::byte((word = word * 1664525 + 1013904223) >> 24);
        list.push_back(std::move(message));
    }
    return list;
}

}  // namespace

TEST_CASE("Ranks reduce numbers of every type") {
    const Communicator ranks;
    check_reductions<double>(ranks);
    check_reductions<float>(ranks);
    check_reductions<std::int32_t>(ranks);
    check_reductions<std::int64_t>(ranks);
    check_reductions<std::uint32_t>(ranks);
    check_reductions<std::uint64_t>(ranks);
    const std::int64_t large = std::int64_t(1) << 55;
    CHECK(ranks.sum(large + ranks.rank()) == large * ranks.size() + ranks.size() * (ranks.size() - 1) / 2);
    CHECK(ranks.min(-large * ranks.rank()) == -large * (ranks.size() - 1));
}

TEST_CASE("Ranks gather values and pass on a text") {
    struct Pair {
        int number;
        double half;
    };
    const Communicator ranks;
    const auto pairs = ranks.all(Pair{ranks.rank(), ranks.rank() / 2.0});
    REQUIRE(pairs.size() == std::size_t(ranks.size()));
    for (int rank = 0; rank < ranks.size(); ++rank) {
        CHECK(pairs[std::size_t(rank)].number == rank);
        CHECK(pairs[std::size_t(rank)].half == rank / 2.0);
    }
    for (int rank = 0; rank < ranks.size(); ++rank) {
        for (const std::size_t length : {0, 1, 100'000}) {
            const auto text = [&](int of) { return std::string(length, char('a' + of)); };
            CHECK(ranks.text_of(rank, text(ranks.rank())) == text(rank));
        }
    }
}

TEST_CASE("Each rank receives the messages that were sent to it, in order") {
    const Communicator ranks;
    for (unsigned round = 0; round < 40; ++round) {
        // Some ranks are late, so that others have already begun the next round.
        if (round % 3 == 0)
            std::this_thread::sleep_for(std::chrono::milliseconds((unsigned(ranks.rank()) * 7 + round) % 5));
        const auto received = firn::mpi::exchange(ranks, messages(ranks.rank(), ranks.size(), round));
        std::vector<Message> expected;
        for (int from = 0; from < ranks.size(); ++from)
            for (auto& message : messages(from, ranks.size(), round))
                if (message.rank == ranks.rank()) expected.push_back({from, std::move(message.bytes)});
        INFO("round " << round);
        REQUIRE(received.size() == expected.size());
        for (std::size_t i = 0; i < received.size(); ++i) {
            INFO("message " << i << " from rank " << expected[i].rank);
            REQUIRE(received[i].rank == expected[i].rank);
            REQUIRE((received[i].bytes == expected[i].bytes));
        }
    }
}

TEST_CASE("A program's own messages do not meet those of firn") {
    const Communicator ranks;
    const int next = (ranks.rank() + 1) % ranks.size(), last = (ranks.rank() + ranks.size() - 1) % ranks.size();
    for (int tag = 0; tag < 50; ++tag) {
        const int mine = 1000 * tag + ranks.rank();
        MPI_Request request;
        MPI_Isend(&mine, 1, MPI_INT, next, tag, MPI_COMM_WORLD, &request);
        const auto received = firn::mpi::exchange(ranks, {});
        CHECK(received.empty());
        int other = -1;
        MPI_Recv(&other, 1, MPI_INT, last, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
        CHECK(other == 1000 * tag + last);
        MPI_Wait(&request, MPI_STATUS_IGNORE);
    }
}

TEST_CASE("A communicator of some of the ranks numbers these alone") {
    const Communicator ranks;
    const int group = ranks.rank() % 2;
    MPI_Comm split = MPI_COMM_NULL;
    MPI_Comm_split(ranks.get(), group, -ranks.rank(), &split);  // the highest is first
    const Communicator part(split);
    MPI_Comm_free(&split);
    const int of_group = (ranks.size() + 1 - group) / 2;
    REQUIRE(part.size() == of_group);
    CHECK(part.rank() == of_group - 1 - ranks.rank() / 2);
    CHECK(part.sum(1) == of_group);
    const auto copy = part;
    const auto received = firn::mpi::exchange(copy, {{part.size() - 1, std::vector<std::byte>(3)}});
    CHECK(received.size() == (part.rank() == part.size() - 1 ? std::size_t(part.size()) : 0));
}

// About 5 GB of memory on two ranks: by hand.
TEST_CASE("A message may be larger than 2 GiB", "[.large]") {
    const Communicator ranks;
    const std::size_t bytes = (std::size_t(1) << 31) + 12345;
    std::vector<Message> outgoing;
    if (ranks.rank() == 0) {
        outgoing.push_back({ranks.size() - 1, std::vector<std::byte>(bytes, std::byte(1))});
        for (std::size_t at = 0; at < bytes; at += 4096) outgoing[0].bytes[at] = std::byte(at / 4096);
    }
    const auto received = firn::mpi::exchange(ranks, std::move(outgoing));
    if (ranks.rank() != ranks.size() - 1) {
        CHECK(received.empty());
        return;
    }
    REQUIRE(received.size() == 1);
    REQUIRE(received[0].bytes.size() == bytes);
    bool all = true;
    for (std::size_t at = 0; at < bytes; at += 4096) all = all && received[0].bytes[at] == std::byte(at / 4096);
    CHECK(all);
}
