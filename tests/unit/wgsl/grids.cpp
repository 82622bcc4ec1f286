// quick: no
/// \file Programs with grids of distances: what they are told of each grid, and what is refused.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/scenes.hpp"
#include <firn/boundary/collider.hpp>
#include <firn/boundary/shapes.hpp>
#include <firn/boundary/together.hpp>
#include <firn/data/sampled_distance.hpp>
#include <firn/material/fluid.hpp>
#include <firn/wgsl/inputs.hpp>
#include <firn/wgsl/manifest.hpp>
#include <firn/wgsl/program.hpp>

using namespace firn;

namespace program_grids_tests {
namespace {

using Grid = DistanceGrid<float, 3>;

/// All in the box from `lower` to `upper` is `value` away.
Grid filled(const Vec<double, 3>& lower, const Vec<double, 3>& upper, double spacing, double value) {
    return {
        sampled_distance<3>([=](const auto&) { return value; }, {.lower = lower, .upper = upper, .spacing = spacing})};
}

template <class Boundary>
wgsl::Program program(const Boundary& boundary) {
    return wgsl::make_program<QuadraticBSpline, Apic, MlsForce, 3>(Fluid<float>{}, boundary);
}

/// Walls, a grid of 2 x 3 x 4 nodes, a ball, and the outside of a grid of 3 x 2 x 2 nodes.
auto mixed() {
    Grid second = filled({1, 2, 3}, {2, 2.5, 3.5}, 0.5, 7);
    second.origin = {1, 0, 0};
    return Together(Walls<float, 3>::all({0, 0, 0}, {1, 1, 1}, {}),
                    Collider<Grid>{.shape = filled({0, 0, 0}, {0.25, 0.5, 0.75}, 0.25, 5)},
                    Collider<Sphere<float, 3>>{.shape = {0.1F}},
                    Collider<Complement<Grid>>{.shape = {second}, .linear_velocity = {1, 2, 3}});
}

/// There is no program with this boundary, and the error says `part`.
template <class Boundary>
void check_refused(const Boundary& boundary, const std::string& part) {
    test_support::check_refused<parameter_error>([&] { (void)program(boundary); }, part);
}

}  // namespace

TEST_CASE("the grids of a boundary lie one after another in a buffer, and uniforms tell where", "[wgsl]") {
    auto boundary = mixed();
    const wgsl::Program p = program(boundary);
    using Numbers = std::vector<double>;
    const auto of = [&](const std::string& name) { return p.uniform("boundary_" + name).values; };
    CHECK(of("1_shape_grid_first") == Numbers{0});
    CHECK(of("1_shape_grid_nodes") == Numbers{2, 3, 4});
    CHECK(of("1_shape_grid_strides") == Numbers{12, 4, 1});
    CHECK(of("1_shape_grid_spacing") == Numbers{0.25});
    CHECK(of("1_shape_grid_per_spacing") == Numbers{4});
    CHECK(of("3_shape_hollow_grid_first") == Numbers{24});
    CHECK(of("3_shape_hollow_grid_strides") == Numbers{4, 2, 1});
    CHECK(of("3_shape_hollow_grid_lower") == Numbers{0, 2, 3});  // from its origin
    CHECK(p.uniform("boundary_3_shape_hollow_grid_first").type == "u32");
    CHECK(p.uniform("boundary_3_shape_hollow_grid_strides").type == "vec3<u32>");
    CHECK(p.uniform("boundary_3_shape_hollow_grid_nodes").type == "vec3<f32>");
    CHECK(p.buffer("distances").per == "distance");
    CHECK(p.distances.size() == 36);
    CHECK(test_support::holds(wgsl::manifest(p), "\"distances\": 36"));

    Domain<3> domain;
    domain.cell_size = 1.0 / 8;
    Simulation simulation(domain, Fluid<float>{}, FixedPoint<std::int32_t>{});
    simulation.add(sample_box<3>({0.3, 0.3, 0.3}, {0.5, 0.5, 0.5}, {.spacing = 0.05}), 1000);
    const auto inputs = [&](const wgsl::Program& of_program, const wgsl::Limits& limits = {}) {
        return wgsl::make_inputs<3>(of_program, domain, simulation.particles(), 1e-4, limits);
    };
    std::vector<float> expected(24, 5);
    expected.resize(36, 7);
    CHECK(inputs(p).buffers.back() == std::pair{std::string("distances"), expected});

    // Another mesh is other numbers only; a solid that moves keeps them.
    std::get<1>(boundary.parts).shape = filled({0, 0, 0}, {1, 1, 1}, 0.25, 6);
    const wgsl::Program other = program(boundary);
    CHECK(other.code == p.code);
    CHECK(other.uniform("boundary_3_shape_hollow_grid_first").values == Numbers{125});
    wgsl::Inputs moved = inputs(p);
    set_parameters(moved, advanced(mixed(), 0.5), "boundary");
    for (std::size_t k = 0; k < p.uniforms.size(); ++k)
        if (p.uniforms[k].name == "boundary_3_position")
            CHECK(moved.uniform(k) == Numbers{0.5, 1, 1.5});
        else if (p.uniforms[k].name == "boundary_3_shape_hollow_grid_first")
            CHECK(moved.uniform(k) == Numbers{24});

    CHECK_THROWS_AS(inputs(other, {.storage_binding_bytes = 4 * 137 - 1}), parameter_error);
    for (const wgsl::EntryPoint& e : p.entry_points) {
        const bool reads = std::ranges::any_of(
            e.bindings, [&](const auto& b) { return b.first == p.buffer("distances").binding && !b.second; });
        CHECK(reads == (e.name == "grid_update"));
    }
    const wgsl::Program without = program(std::get<2>(boundary.parts));
    for (const std::string& text : {without.code, wgsl::manifest(without)})
        CHECK(!test_support::holds(text, "distances"));
    CHECK(inputs(without).buffers.back().first == "coordinates");
}

TEST_CASE("grids that a program cannot have are refused with what to do", "[wgsl]") {
    check_refused(Collider<Grid>{}, "holds no numbers");
    const Grid far = filled({1e4, 0, 0}, {1e4 + 1, 1, 1}, 0.5, 1);
    check_refused(Collider<Grid>{.shape = far}, "set the shape's `origin`");
    CHECK_NOTHROW(program(Collider<Grid>{.shape = {far.numbers, {1e4, 0, 0}}}));
    DistanceNumbers<float, 3> long_one{{}, 1, {1 << 24, 2, 2}, std::vector<float>(std::size_t{4} << 24)};
    check_refused(Collider<Grid>{.shape = {std::make_shared<const DistanceNumbers<float, 3>>(std::move(long_one))}},
                  "16777216 nodes along an axis");
}

}  // namespace program_grids_tests
