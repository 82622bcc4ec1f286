/// \file Sorting by blocks, cells and ids: complete, colour-safe, and the same for any number of threads and any order
/// in memory.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include "support/scenes.hpp"

#include <set>

using namespace firn;

namespace {

/// Dense matter in one half, a few particles a block in the other.
template <class S, int D>
scenes::RandomCloud<S, D> cloud_and_spray(std::size_t count) {
    scenes::RandomCloud<S, D> cloud(count);
    for (std::size_t p = 0; p < count; ++p)
        if (p % 16 != 0)
            for (std::size_t a = 0; a < std::size_t(D); ++a)
                cloud.x[p * std::size_t(D) + a] = S(-0.2) + (cloud.x[p * std::size_t(D) + a] + S(0.2)) / 2;
    return cloud;
}

}  // namespace

TEMPLATE_TEST_CASE("Every particle lies once in the range of its block, by cell and number", "", float, double) {
    auto cloud = cloud_and_spray<TestType, 3>(20000);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 2);
    std::set<std::uint32_t> seen;
    for (const auto& range : partition.ranges) {
        std::pair<int, std::uint32_t> before{-1, 0};
        for (std::size_t i = 0; i < range.particles; ++i) {
            const std::uint32_t p = partition.order[range.first_slot + i];
            REQUIRE(p < cloud.size());
            CHECK(seen.insert(p).second);
            int cell = 0;
            for (std::size_t a = 0; a < 3; ++a) {
                const TestType cells = (cloud.x[3 * p + a] - TestType(-0.25)) * TestType(1 / 0.05);
                const int node = int(std::floor(cells - TestType(0.5)));
                CHECK(node >> 2 == range.block[a]);
                cell += (node & 3) << 2 * a;
            }
            CHECK(std::pair{cell, p} > before);
            before = {cell, p};
        }
    }
    CHECK(seen.size() == cloud.size());
    CHECK(partition.particles == cloud.size());
}

TEST_CASE("Groups are whole packs of one block, or of the sparse blocks of one cube, and hold every range once") {
    auto cloud = cloud_and_spray<float, 3>(20000);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    std::size_t range = 0, slot = 0, sparse = 0, dense = 0;
    for (const BlockGroup& group : partition.groups) {
        REQUIRE(group.first_range == range);
        REQUIRE(group.first_slot == slot);
        std::size_t particles = 0;
        for (std::size_t r = range; r < range + group.ranges; ++r) {
            CHECK(partition.ranges[r].first_slot == slot + particles);
            for (std::size_t a = 0; a < 3; ++a)
                CHECK(partition.ranges[r].block[a] >> 1 == partition.ranges[range].block[a] >> 1);
            CHECK(group.sparse == (partition.ranges[r].particles <= sparse_particles));
            particles += partition.ranges[r].particles;
        }
        CHECK(group.particles == particles);
        if (!group.sparse) CHECK(group.ranges == 1);
        for (std::size_t i = slot + particles; i < slot + group.packs() * pack_size; ++i)
            CHECK(partition.order[i] == no_particle);
        ++(group.sparse ? sparse : dense);
        range += group.ranges;
        slot += group.packs() * pack_size;
    }
    CHECK(range == partition.ranges.size());
    CHECK(slot == partition.slots());
    CHECK(sparse > 10);
    CHECK(dense > 10);
    for (std::size_t i = 1; i < partition.by_block.size(); ++i)
        CHECK(block_key<3>(partition.ranges[partition.by_block[i - 1]].block) <
              block_key<3>(partition.ranges[partition.by_block[i]].block));
}

namespace {

/// The blocks that a group may have along an axis, the first and the last.
std::pair<int, int> extent(const BlockPartition<3>& partition, const BlockGroup& group, std::size_t axis) {
    const int block = partition.ranges[group.first_range].block[axis];
    return group.sparse ? std::pair{block & ~1, block | 1} : std::pair{block, block};
}

/// Each group reaches `allowed_drift` cells below its blocks and support − 1 + drift above.
template <class Kernel>
bool share_nodes(const BlockPartition<3>& partition, const BlockGroup& one, const BlockGroup& other) {
    int distance = 0;  // in blocks, between the closest of the two
    for (std::size_t a = 0; a < 3; ++a) {
        const auto [low, high] = extent(partition, one, a);
        const auto [other_low, other_high] = extent(partition, other, a);
        distance = std::max({distance, other_low - high, low - other_high});
    }
    return (distance - 1) * block_size < Kernel::support - 1 + 2 * allowed_drift;
}

}  // namespace

TEMPLATE_TEST_CASE("The nodes of two groups of one phase never overlap, and every group has a phase", "", Linear,
                   QuadraticBSpline, CubicBSpline) {
    auto cloud = cloud_and_spray<float, 3>(20000);
    for (float& x : cloud.x) x = (x + 0.2f) * 2 - 0.249f;  // more blocks, some at negative coordinates
    cloud.domain.upper = Vec<double, 3>::filled(2);
    const auto partition = partition_particles<TestType>(cloud.view(), cloud.size(), cloud.domain, 1);
    std::set<std::uint32_t> seen(partition.by_phase.begin(), partition.by_phase.end());
    CHECK(seen.size() == partition.groups.size());
    CHECK(partition.by_phase.size() == partition.groups.size());
    std::size_t first = 0;
    for (const std::size_t last : partition.phase_ends) {
        for (std::size_t i = first; i < last; ++i)
            for (std::size_t k = i + 1; k < last; ++k)
                CHECK(!share_nodes<TestType>(partition, partition.groups[partition.by_phase[i]],
                                             partition.groups[partition.by_phase[k]]));
        first = last;
    }
    CHECK(first == partition.by_phase.size());
    // As many phases as that takes, not one more: parity, but for the dense blocks of the cubic kernel.
    CHECK(partition.phase_ends.size() == (TestType::support == 4 ? 27 + 8 : 8 + 8));
}

TEST_CASE(
    "Much spray is scattered band by band; of two groups that share nodes the even one comes first all the same") {
    // Every second block of 42 × 40 × 14, some at negative coordinates: 20 or 21 cubes along an axis.
    std::vector<BlockRange<3>> blocks;
    for (int i = -3; i < 39; ++i)
        for (int j = -1; j < 39; ++j)
            for (int k = 0; k < 14; ++k)
                if ((i + j + k) % 2 == 0) blocks.push_back({{i, j, k}, 0, 3});
    const BlockPartition<3> partition = arrange<3>(blocks, colours_along_axis<QuadraticBSpline>);
    CHECK(partition.phase_ends.size() > 3 * 8);
    CHECK(partition.groups.size() / partition.phase_ends.size() >= cubes_of_phase / 2);

    std::vector<std::size_t> turn(partition.groups.size()), phase(turn.size());
    std::size_t at = 0;
    for (std::size_t p = 0; p < partition.phase_ends.size(); ++p)
        for (; at < partition.phase_ends[p]; ++at) {
            turn[partition.by_phase[at]] = at;
            phase[partition.by_phase[at]] = p;
        }
    CHECK(at == turn.size());
    std::size_t pairs = 0, wrong = 0;
    const auto colour = [&](std::size_t g) {
        BlockCoordinate<3> cube{};
        for (std::size_t a = 0; a < 3; ++a) cube[a] = extent(partition, partition.groups[g], a).first >> 1;
        return block_colour<3>(cube, 2);
    };
    for (std::size_t g = 0; g < turn.size(); ++g)
        for (std::size_t k = 0; k < g; ++k) {
            if (!share_nodes<QuadraticBSpline>(partition, partition.groups[g], partition.groups[k])) continue;
            ++pairs;
            wrong += std::size_t(phase[g] == phase[k] || (colour(g) < colour(k)) != (turn[g] < turn[k]));
        }
    CHECK(pairs > 10 * turn.size());
    CHECK(wrong == 0);
}

TEMPLATE_TEST_CASE_SIG("However far particles have gone from the block they were sorted into, they are found", "",
                       ((int D), D), 2, 3) {
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 64};
    Particles<double, D> particles(domain);
    test_support::Random random(5);
    for (int i = 0; i < 20'000; ++i) particles.push_back(random.vector<D>(0.2, 0.8), {}, 1, 1);
    sort_particles<QuadraticBSpline>(particles);
    for (const double cells : {0.3, 1.0, 4.0, 12.0}) {
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot)) {
                const auto moved = random.vector<D>(-cells, cells);
                for (int a = 0; a < D; ++a) *particles.view().position.at(slot, a) += moved[a];
            }
        const auto partition = partition_particles<QuadraticBSpline>(particles, 2);
        std::vector<int> seen(particles.slots());
        for (const auto& range : partition.ranges) {
            std::pair<int, std::uint32_t> before{-1, 0};
            for (std::size_t i = 0; i < range.particles; ++i) {
                const std::uint32_t slot = partition.order[range.first_slot + i];
                ++seen[slot];
                int cell = 0;
                for (int a = 0; a < D; ++a) {
                    const int node = int(std::floor(64 * particles.exact_position(slot)[a] - 0.5));
                    CHECK(node >> 2 == range.block[std::size_t(a)]);
                    cell += (node & 3) << 2 * a;
                }
                CHECK(std::pair{cell, particles.id(slot)} > before);
                before = {cell, particles.id(slot)};
            }
        }
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            CHECK(seen[slot] == int(particles.is_particle(slot)));
    }
}

TEST_CASE("The order is the same for any number of threads") {
    scenes::RandomCloud<float, 2> cloud(30000);
    const auto one = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    for (int threads : {2, 3, 7}) {
        const auto many = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, threads);
        CHECK(many.order == one.order);
        CHECK(many.by_phase == one.by_phase);
        CHECK(many.phase_ends == one.phase_ends);
    }
}

TEMPLATE_TEST_CASE_SIG("Where particles lie in memory makes no difference to their order", "", ((int D), D), 2, 3) {
    const Domain<D> domain{Vec<double, D>::zero(), Vec<double, D>::filled(1), 1.0 / 64};
    Particles<float, D> particles(domain);
    test_support::Random random(7);
    const auto fill = [&](int count, double from, double to) {
        for (int i = 0; i < count; ++i) particles.push_back(random.vector<D>(from, to), {}, 1, 1);
    };
    fill(300, 0.4, 0.42);  // a cell of more than 64, and such of up to 16
    fill(6000, 0.5, D == 2 ? 0.8 : 0.62);
    fill(2000, 0.1, 0.9);
    Particles<float, D> other = particles;
    for (const std::uint64_t seed : {1, 2}) {
        scenes::shuffle(other, seed);
        CHECK(other.id(0) != particles.id(0));
        Particles<float, D> sorted = particles, too = other;
        const auto expected = sort_particles<QuadraticBSpline>(sorted, 1);
        const auto partition = sort_particles<QuadraticBSpline>(too, 2);
        CHECK(partition.order == expected.order);
        CHECK(partition.by_phase == expected.by_phase);
        CHECK(scenes::has(partition, scenes::Kind::dense));
        CHECK(scenes::has(partition, scenes::Kind::spray));
    }
}

TEST_CASE("Room that no particle has been put into is sorted as if it were not there") {
    Particles<float, 3> particles({{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 0.1});
    particles.reserve(100);
    CHECK(sort_particles<QuadraticBSpline>(particles).slots() == 0);
    particles.reserve(100);
    particles.push_back({0.5, 0.5, 0.5}, {}, 1, 1);
    aligned_vector<std::uint32_t> order(pack_size, no_particle);
    order[0] = 0;
    CHECK(sort_particles<QuadraticBSpline>(particles).order == order);
}

TEST_CASE("An elastic particle of dense matter takes at most 200 bytes, what sorting needs included") {
    Particles<float, 3> particles({{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 1.0 / 32});
    const auto x = sample_box<3>({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}, {.spacing = 1.0 / 64}).positions;
    particles.reserve(x.size());
    for (const auto& at : x) particles.push_back(at, {}, 1, 1);
    for (int sorts = 1; sorts < 6; ++sorts) {
        const auto partition = sort_particles<QuadraticBSpline>(particles);
        CHECK(particles.bytes() + partition.order.capacity() * sizeof(std::uint32_t) <= 200 * x.size());
        const double cells = sorts / 32.0;  // somewhere else: other blocks, other padding
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot))
                particles.set_position(slot, x[particles.id(slot)] + Vec<double, 3>{cells, cells, cells});
    }
}

TEST_CASE("Dense matter is sorted in the memory that it was added to, wherever it moves") {
    Particles<float, 3> particles({{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 1.0 / 64});
    const auto x = sample_box<3>({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}, {.spacing = 1.0 / 128}).positions;
    particles.reserve(x.size());
    for (const auto& at : x) particles.push_back(at, {}, 1, 1);
    const auto* const memory = reinterpret_cast<const std::byte*>(particles.view().position.data);
    for (int sorts = 1; sorts < 6; ++sorts) {
        sort_particles<QuadraticBSpline>(particles);
        if (sorts % 2 == 1) CHECK(particles.room() == memory);  // fields have moved to its end
        const double cells = sorts / 64.0;
        for (std::size_t slot = 0; slot < particles.slots(); ++slot)
            if (particles.is_particle(slot))
                particles.set_position(slot, x[particles.id(slot)] + Vec<double, 3>{cells, cells, cells});
    }
}

TEST_CASE("Particles that are not finite or outside are refused, by number, count and place") {
    scenes::RandomCloud<float, 2> cloud(100);
    const auto partition = [&] {
        return partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain);
    };
    CHECK_NOTHROW(partition());
    cloud.x[2 * 41] = std::numeric_limits<float>::quiet_NaN();
    cloud.x[2 * 57 + 1] = 3.5f;
    try {
        partition();
        FAIL("nothing was thrown");
    } catch (const particle_error& error) {
        const std::string text = error.what();
        CAPTURE(text);
        CHECK(text.find("2 of 100") != std::string::npos);
        CHECK(text.find("41 at (nan") != std::string::npos);
        CHECK(text.find("57 at (") != std::string::npos);
        CHECK(text.find("3.5)") != std::string::npos);
    }
    REQUIRE_THROWS_AS(partition_particles<QuadraticBSpline>(cloud.view(), 0, cloud.domain), particle_error);
}
