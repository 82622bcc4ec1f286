// labels: full
// ranks: 2 4 8
// threads: 1
// release: -O0
/// \file The program that counts messages without MPI (benchmarks/mpi) counts what is sent: the bytes from each rank to
/// each other, step by step.
#include "support/catch.hpp"

#include "../../benchmarks/mpi/messages.hpp"
#include "../../benchmarks/mpi/scenes.hpp"
#include "scenes.hpp"

#include <cstring>
#include <functional>
#include <utility>

namespace {

/// What this rank has sent to each rank in this step.
struct Sent {
    std::vector<std::uint64_t> sums{}, returns{}, messages{};
    std::function<void()> at_first{};  ///< called before the first message

    void reset(int ranks) {
        for (auto* const numbers : {&sums, &returns, &messages}) numbers->assign(std::size_t(ranks), 0);
    }
};
Sent sent;

}  // namespace

/// MPI lets programs take the place of its functions: the messages of P2G go through this one.
extern "C" int MPI_Isend(const void* bytes, int count, MPI_Datatype type, int rank, int tag, MPI_Comm all,
                         MPI_Request* request) {
    if (!sent.sums.empty() && tag >= firn::mpi::Communicator::tags) {
        if (sent.at_first) std::exchange(sent.at_first, nullptr)();
        const bool returns = tag == firn::mpi::Communicator::tags + 2;
        (returns ? sent.returns : sent.sums)[std::size_t(rank)] += std::uint64_t(count);
        ++sent.messages[std::size_t(rank)];
    }
    return PMPI_Isend(bytes, count, type, rank, tag, all, request);
}

namespace {

using namespace firn;

/// A particle, or padding, as P2G finds it. P2G counts padding to the box of a group.
struct Place {
    std::int32_t set, is_particle;
    std::array<std::int32_t, 3> block, node;  ///< the block into which it was sorted, and its base node
};

/// Returns this rank's particles and padding.
template <class Kernel, class Simulation>
std::vector<Place> places(const Simulation& simulation) {
    std::vector<Place> all;
    const auto add = [&](const auto& set, int number) {
        const auto& particles = set.particles();
        for (std::size_t slot = 0; slot < particles.used_slots(); ++slot) {
            Place& place = all.emplace_back(Place{number, particles.is_particle(slot), {}, {}});
            for (int a = 0; a < Simulation::dimension; ++a) {
                const int block = particles.block(slot)[std::size_t(a)];
                place.block[std::size_t(a)] = block;
                place.node[std::size_t(a)] = block_size * block + int(base_node<Kernel>(particles.place(slot)[a]));
            }
        }
    };
    [&]<std::size_t... I>(std::index_sequence<I...>) {
        (add(simulation.template set<I>(), int(I)), ...);
    }(std::make_index_sequence<Simulation::material_count>{});
    return all;
}

/// Counts a step on rank 0, and compares it with what all ranks have sent in it.
/// \param mine  this rank's particles; none if it has sent nothing
template <class Kernel, class S, class Simulation>
void compare(Simulation& simulation, const std::vector<Place>& mine) {
    constexpr int D = Simulation::dimension;
    const mpi::Communicator& all = simulation.execution.communicator();
    const auto ranks = std::size_t(all.size()), me = std::size_t(all.rank());
    std::vector<std::uint64_t> sums(ranks * ranks, 0), returns(sums), messages(sums);
    std::copy(sent.sums.begin(), sent.sums.end(), sums.begin() + std::ptrdiff_t(me * ranks));
    std::copy(sent.returns.begin(), sent.returns.end(), returns.begin() + std::ptrdiff_t(me * ranks));
    std::copy(sent.messages.begin(), sent.messages.end(), messages.begin() + std::ptrdiff_t(me * ranks));
    for (auto* const numbers : {&sums, &returns, &messages}) all.sum(std::span<std::uint64_t>(*numbers));
    const auto bytes_of_mine = std::as_bytes(std::span(mine));
    const auto gathered_bytes = mpi::exchange(all, {{0, {bytes_of_mine.begin(), bytes_of_mine.end()}}});
    if (all.rank() > 0) return;

    geometry::Gathered<D> gathered;
    for (const mpi::Message& message : gathered_bytes)
        for (std::size_t at = 0; at < message.bytes.size(); at += sizeof(Place)) {
            Place place;
            std::memcpy(&place, message.bytes.data() + at, sizeof place);
            BlockCoordinate<D> block{}, node{};
            std::copy_n(place.block.begin(), D, block.begin());
            std::copy_n(place.node.begin(), D, node.begin());
            gathered.add(block, node, place.set, place.is_particle);
        }
    geometry::Scheme<D> scheme;
    scheme.support = Kernel::support;
    scheme.colours = colours_along_axis<Kernel>;
    scheme.node_bytes = node_width * sizeof(S);
    for (int a = 0; a < D; ++a) scheme.period[std::size_t(a)] = block_period(simulation.domain(), a);
    std::vector<mpi::Cuts<D>> cuts;
    for (std::size_t m = 0; m < Simulation::material_count; ++m)
        cuts.push_back(simulation.execution.template cuts<D>(m));
    const auto matter = gathered.matter();
    const geometry::Messages counted = geometry::count_messages<D>(matter, cuts, scheme);
    std::uint64_t bytes = 0;
    for (std::size_t from = 0; from < ranks; ++from)
        for (std::size_t to = 0; to < ranks; ++to) {
            const geometry::Bytes of = counted.between(int(from), int(to));
            INFO("step " << simulation.steps() << ", from rank " << from << " to rank " << to);
            CHECK(of.sums == sums[from * ranks + to]);
            CHECK(of.returns == returns[from * ranks + to]);
            CHECK(of.messages() == messages[from * ranks + to]);
            bytes += of.sums + of.returns;
        }
    CHECK(bytes > 1000);
}

template <class Kernel, class S, class Simulation>
void count(Simulation simulation, int steps) {
    for (int step = 0; step < steps; ++step) {
        std::vector<Place> mine;
        sent.reset(simulation.execution.communicator().size());
        sent.at_first = [&] { mine = places<Kernel>(simulation); };
        simulation.step();
        compare<Kernel, S>(simulation, mine);
    }
    sent = {};
}

const auto coloured = [] { return mpi::Distributed<Coloured>{}; };

}  // namespace

TEST_CASE("Counted messages are those that are sent: dense matter", "[mpi]") {
    count<QuadraticBSpline, float>(scenes::two_cubes(coloured()), 25);
}

TEST_CASE("Counted messages are those that are sent: spray", "[mpi]") {
    count<QuadraticBSpline, float>(scenes::spray(coloured()), 10);
}

TEST_CASE("Counted messages are those that are sent: four materials", "[mpi]") {
    count<QuadraticBSpline, float>(scenes::four_materials(coloured()), 10);
}

TEST_CASE("Counted messages are those that are sent: 2D, periodic, double, the cubic kernel", "[mpi]") {
    count<CubicBSpline, double>(scenes::waves(coloured()), 25);
}

TEST_CASE("A scene made block by block is that of its particles", "[mpi]") {
    geometry::Scene scene{.particles = 8 * 21 * 21 * 21, .drift = geometry::Drift::flow, .phase = 0.3, .turn = 0.6};
    const std::array<double, 3> flow{std::cos(0.6), 0.8 * std::sin(0.6), 0.6 * std::sin(0.6)};
    for (const double phase : {0., 0.3, 0.9}) {
        scene.phase = phase;
        geometry::Gathered<3> gathered;
        for (int i = 0; i < 42 * 42 * 42; ++i) {
            BlockCoordinate<3> block{}, node{};
            for (std::size_t a = 0; a < 3; ++a) {
                const int along = a == 0 ? i % 42 : a == 1 ? i / 42 % 42 : i / 42 / 42;
                const double x = 0.25 + 0.5 * along + block_size * scene.corner;  // [cells]
                block[a] = int(std::floor((x - 0.5) / block_size));
                node[a] = int(std::floor(x - 0.5 + phase * flow[a]));
            }
            gathered.add(block, node, 0);
        }
        const auto particles = gathered.matter(), blocks = geometry::matter_of(scene);
        REQUIRE(blocks.size() == particles.size());
        bool same = true;
        for (std::size_t i = 0; i < blocks.size(); ++i)
            same = same && blocks[i].block == particles[i].block && blocks[i].particles == particles[i].particles &&
                   blocks[i].first == particles[i].first && blocks[i].last == particles[i].last;
        CHECK(same);
    }
}
