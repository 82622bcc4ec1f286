// part: arithmetic
/// \file What does not fit into memory is refused before it is asked for, with the number of bytes.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/data/mesh_distance.hpp>
#include <firn/data/particles.hpp>
#include <firn/data/sampling.hpp>
#include <firn/data/sparse_grid.hpp>
#include <firn/lagrangian/rope.hpp>
#include <firn/lagrangian/soft_body.hpp>

#include "meshes.hpp"
using namespace firn;
using test_support::check_refused;
using test_support::holds;
using test_support::message;

namespace {

/// The message has the number of bytes, and there are no other kinds of it.
template <class F>
void refused(const F& f, const std::string& bytes) {
    check_refused<memory_error>(f, bytes);
    check_refused<memory_error>(f, "of memory; there are at most ");
}

/// For as long as this lives the program allows itself no more.
struct Budget {
    explicit Budget(double bytes) { memory_budget = bytes; }
    ~Budget() { memory_budget = std::numeric_limits<double>::infinity(); }
};

}  // namespace

TEST_CASE("what no machine holds is refused with the bytes it would need") {
    // 1e18 positions of 24 bytes; a sphere of radius ½ has π/6 of that.
    refused([] { return sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 1e-6}); }, "2.4e+19 bytes");
    refused([] { return sample_sphere<3>({0, 0, 0}, 0.5, {.spacing = 1e-6}); }, "1.25664e+19 bytes");
    refused([] { return sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 1e-6, .pattern = Pattern::poisson_disk}); },
            "2.4e+19 bytes");
    refused([] { return sample_box<2>({0, 0}, {1e30, 1e30}, {.spacing = 1e-6}); }, "1.6e+73 bytes");
    refused([] { return sample_mesh(test_meshes::unit_cube(), {.spacing = 1e-6}); }, "bytes");
    refused([] { return poisson_disk_points<3>({0, 0, 0}, {1, 1, 1}, 1e-6); }, "bytes");
    refused([] { lattice_points<3>({0, 0, 0}, {1000000, 1000000, 1000000}, 1e-6); }, "2.4e+19 bytes");
    // 1e5 nodes along each side, and three beyond each face: 4 bytes each.
    refused([] { return mesh_distance(test_meshes::unit_cube(), {.spacing = 1e-5, .most_bytes = 1e300}); },
            "(4000840058801372 bytes)");
    // 1e12 points of 24 bytes, 6e12 links and 2e12 facets of 12.
    refused([] { return cloth({{0, 0, 0}}, {{1, 0, 0}}, {{0, 1, 0}}, {1000000, 1000000}); }, "GiB");
    refused([] { return cloth({{0, 0, 0}}, {{1, 0, 0}}, {{0, 1, 0}}, {SIZE_MAX, SIZE_MAX}); }, "bytes");
}

TEST_CASE("what this program cannot have is refused before it is asked for") {
    const Samples<3> samples = sample_box<3>({0, 0, 0}, {1, 1, 1}, {.spacing = 0.05});
    Particles<float, 3> particles({});
    BlockPartition<2> partition;
    for (int i = 0; i < 2000; ++i) partition.ranges.push_back({{8 * i, 0}, 0, 1}), partition.by_block.push_back(i);
    SparseGrid<double, 2> grid({{0, 0}, {1e5, 4}, 1.0});

    const Budget budget(1e6);
    refused([&] { return lattice_body(samples); }, "A soft body of 8000 cells");
    refused([&] { return rope<3>({{0, 0, 0}}, {{1, 0, 0}}, 30000); }, "A net of 30001 points");
    refused([&] { particles.reserve(20000); }, "20000 particles");
    refused([&] { grid.activate(partition); }, "18000 blocks of 16 nodes");
    CHECK_NOTHROW(particles.reserve(1000));
}

TEST_CASE("a number of bytes is given in full, and in the unit that is read at a glance") {
    CHECK(detail::bytes_text(512) == "512 bytes");
    CHECK(detail::bytes_text(3.5 * 1024 * 1024 * 1024) == "3.5 GiB (3758096384 bytes)");
    CHECK(detail::bytes_text(std::numeric_limits<double>::infinity()).find("inf") == 0);
    CHECK(memory_limit() > 1e6);
    CHECK_NOTHROW(require_memory(0, "Nothing", ""));
}

TEST_CASE("a grid of distances with more nodes than a whole number counts is not taken for an empty one") {
    DistanceNumbers<float, 3> grid;
    grid.spacing = 1;
    grid.nodes = {1 << 22, 1 << 21, 1 << 21};  // 2^64
    CHECK(holds(message<parameter_error>([&] { grid.check(); }), "1.84467441e+19 nodes but 0 values"));
}
