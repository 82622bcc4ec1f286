/// \file Sorting by blocks: complete, stable, colour-safe, and the same for any number of threads.
#include "support/catch.hpp"
#include "support/scenes.hpp"

#include <set>

using namespace firn;

TEMPLATE_TEST_CASE("Every particle lies once in the range of its block, in the order it had", "", float, double) {
    scenes::RandomCloud<TestType, 3> cloud(20000);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 2);
    std::set<std::uint32_t> seen;
    for (const auto& range : partition.ranges) {
        REQUIRE(range.first_slot % pack_size == 0);
        std::uint32_t before = 0;
        for (std::size_t i = 0; i < range.packs() * pack_size; ++i) {
            const std::uint32_t p = partition.order[range.first_slot + i];
            if (i >= range.particles) {
                CHECK(p == no_particle);
                continue;
            }
            CHECK(seen.insert(p).second);
            CHECK((i == 0 || p > before));  // stable
            before = p;
            for (std::size_t a = 0; a < 3; ++a) {
                const TestType cells = (cloud.x[3 * p + a] - TestType(-0.25)) * TestType(1 / 0.05);
                CHECK(int(std::floor(cells - TestType(0.5))) >> 2 == range.block[a]);
            }
        }
    }
    CHECK(seen.size() == cloud.size());
    CHECK(partition.particles == cloud.size());
}

TEST_CASE("Blocks of one colour are two blocks apart, so that their nodes never overlap") {
    scenes::RandomCloud<float, 3> cloud(20000);
    const auto partition = partition_particles<QuadraticBSpline>(cloud.view(), cloud.size(), cloud.domain, 1);
    std::size_t ranges = 0;
    for (const auto& colour : partition.colours) {
        ranges += colour.size();
        for (const auto i : colour)
            for (const auto j : colour) {
                if (i == j) continue;
                int distance = 0;
                for (std::size_t a = 0; a < 3; ++a)
                    distance =
                        std::max(distance, std::abs(partition.ranges[i].block[a] - partition.ranges[j].block[a]));
                CHECK(distance * block_size >= arena_size<QuadraticBSpline>);
            }
    }
    CHECK(ranges == partition.ranges.size());
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
