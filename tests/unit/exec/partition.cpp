/// \file Sorting by blocks: complete, stable, colour-safe, and the same for any number of threads.
#include "support/catch.hpp"
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

TEMPLATE_TEST_CASE("Every particle lies once in the range of its block, by cell, and in the order it had", "", float,
                   double) {
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
                cell = cell * 4 + (node & 3);
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

TEMPLATE_TEST_CASE("The nodes of two groups of one colour never overlap, and every group has a colour", "", Linear,
                   QuadraticBSpline, CubicBSpline) {
    auto cloud = cloud_and_spray<float, 3>(20000);
    for (float& x : cloud.x) x = (x + 0.2f) * 2 - 0.249f;  // more blocks, some at negative coordinates
    cloud.domain.upper = Vec<double, 3>::filled(2);
    const auto partition = partition_particles<TestType>(cloud.view(), cloud.size(), cloud.domain, 1);
    std::set<std::uint32_t> seen;
    for (const auto& colour : partition.colours)
        for (const std::uint32_t g : colour) {
            CHECK(seen.insert(g).second);
            for (const std::uint32_t other : colour) {
                if (other == g) continue;
                int distance = 0;  // in blocks, between the closest of the two
                for (std::size_t a = 0; a < 3; ++a) {
                    const auto extent = [&](std::uint32_t group) {
                        const BlockGroup& of = partition.groups[group];
                        const int block = partition.ranges[of.first_range].block[a];
                        return of.sparse ? std::pair{block & ~1, block | 1} : std::pair{block, block};
                    };
                    const auto [low, high] = extent(g);
                    const auto [other_low, other_high] = extent(other);
                    distance = std::max({distance, other_low - high, low - other_high});
                }
                // Each reaches `allowed_drift` cells below its blocks and support − 1 + drift above.
                CHECK((distance - 1) * block_size >= TestType::support - 1 + 2 * allowed_drift);
            }
        }
    CHECK(seen.size() == partition.groups.size());
    // As many colours as that takes, not one more: parity, but for the dense blocks of the cubic kernel.
    CHECK(partition.colours.size() == (TestType::support == 4 ? 27 + 8 : 8 + 8));
}

TEST_CASE("The order is the same for any number of threads") {
    scenes::RandomCloud<float, 2> cloud(30000);
    const auto one = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    for (int threads : {2, 3, 7}) {
        const auto many = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, threads);
        CHECK(many.order == one.order);
        CHECK(many.colours == one.colours);
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
