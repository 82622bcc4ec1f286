// quick: no
/// \file A mesh of a scene file as a solid: bit for bit the collider of the same mesh in a simulation with types.
#include "support/catch.hpp"
#include <firn/any/run_of.hpp>
#include <firn/any_simulation.hpp>
#include <firn/simulation.hpp>

#include "../../../examples/support/scene_file.hpp"

#include <string>

namespace mesh_solid_tests {
namespace {

using namespace firn;

using Few = Offer<OfferedMaterials<FixedCorotated>, OfferedTransfers<Apic>, OfferedPrecisions<float>>;
using Bunny = Collider<DistanceGrid<float, 3>>;

const std::filesystem::path data = FIRN_TEST_EXAMPLES_DIR "/data";

const std::string text = R"({
  "domain": {"upper": [1, 1, 1], "cell_size": 0.0625},
  "materials": [{"name": "fixed_corotated", "properties": {"young": 1e4, "poisson": 0.25}}],
  "boundary": [
    {"shape": "mesh", "file": "bunny.obj", "size": 0.5, "position": [0.5, 0.25, 0.5], "friction": 0.5,
     "linear_velocity": [0.25, 0, 0], "angular_velocity": [0, 3, 0]},
    {"shape": "walls", "contact": "slip"}
  ],
  "bodies": [
    {"shape": "box", "lower": [0.3, 0.5, 0.3], "upper": [0.7, 0.7, 0.7], "density": 1000, "velocity": [0, -3, 0]}
  ],
  "end": 0.1
})";

}  // namespace

TEST_CASE("a mesh in a scene has the bits of a typed collider", "[any]") {
    const auto scene = example::SceneReader(data, 1).read(JsonValue::parse(text));
    AnySimulation<3> any(scene.choice, Few{});
    any.add(0, scene.bodies[0].samples, 1000, {0, -3, 0});

    const auto mesh = fitted(read_obj(data / "bunny.obj"), {}, 0.5);
    const double h = 0.0625;
    const Bunny bunny{.shape = {mesh_distance(mesh, {.spacing = 0.5 * h, .band = 1.5 * h + 2 * h})},
                      .friction = 0.5,
                      .position = {0.5, 0.25, 0.5},
                      .linear_velocity = {0.25, 0, 0},
                      .angular_velocity = {0, 3, 0}};
    const Domain<3> domain{{0, 0, 0}, {1, 1, 1}, h};
    const auto walls = Walls<float, 3>::all(domain.lower, domain.upper, {Contact::slip, 0});
    Simulation typed(domain, FixedCorotated<float>::from_young_poisson(1e4, 0.25), Together(walls, bunny));
    typed.add(scene.bodies[0].samples, 1000, {0, -3, 0});

    any.measure_reactions();
    typed.reactions.emplace();
    any.advance(0.1);
    typed.advance(0.1);
    CHECK(any.steps() > 10);
    const auto mine = std::get<State<float>>(any.state(0)), theirs = state_of(typed);
    CHECK(mine.fields == theirs.fields);
    CHECK(mine.time == theirs.time);
    const auto moved = std::get<example::MeshSolid>(any.boundary_part(0));
    const auto& expected = std::get<1>(typed.boundary.parts);
    CHECK(moved.position[0] == expected.position[0]);
    CHECK(moved.position[0] == Approx(0.525));
    CHECK(moved.rotation[2] == expected.rotation[2]);
    CHECK(moved.rotation[2] == Approx(std::sin(0.5 * 3 * 0.1)));
    CHECK(any.reaction(0).impulse[1] == typed.reactions->parts[1].impulse[1]);
    CHECK(any.reaction(0).impulse[1] > 0);  // the bunny bears the body
}

}  // namespace mesh_solid_tests
