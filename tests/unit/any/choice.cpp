/// \file Choices of simulations: from JSON text, with the line of each mistake, and from states; materials by names.
#include "support/message.hpp"
#include <firn/any/json.hpp>
#include <firn/any/offer.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/material/plastic_volume.hpp>
#include <firn/simulation.hpp>

#include <string>
#include <vector>

namespace choice_tests {
namespace {

using namespace firn;
using test_support::check_refused;

const std::string whole = R"({
  "dimension": 3,
  "precision": "double",
  "domain": {
    "lower": [-1, 0, -1], "upper": [1, 2, 1], "cell_size": 0.0625,
    "periodic": [true, false, false]
  },
  "transfer": "aflip",
  "transfer_parameters": {"alpha": 0.5},
  "kernel": "cubic_b_spline",
  "force": "weight_gradient",
  "materials": [
    {"name": "sand", "properties": {"friction_angle": 30}, "parameters": {"mu": 1e4}},
    {"name": "fluid"}
  ],
  "boundary": [
    {"shape": "walls", "contact": "slip", "friction": 0.25,
     "faces": {"y_lower": {"contact": "stick"}, "z_upper": {"friction": 0.5}}, "nodes_behind": "mirrored"},
    {"shape": "sphere", "radius": 0.25, "position": [0, 1, 0.5], "linear_velocity": [0, -1, 0], "friction": 0.125},
    {"shape": "box", "half_extents": [0.5, 0.25, 0.125], "rotation": {"axis": [0, 2, 0], "degrees": 90},
     "contact": "stick", "angular_velocity": [0, 1, 0], "thickness": 0.01, "thickness_in_cells": 1},
    {"shape": "half_space", "outward": [0.6, 0.8, 0]},
    {"shape": "capsule", "half_length": 0.5, "radius": 0.125, "rotation": [1, 0, 0, 0]}
  ],
  "gravity": [0, -3.7, 0],
  "fixed_time_step": 1e-4,
  "most_steps_between_sorts": 50,
  "threads": 3
})";

/// The text `whole` with one part replaced.
std::string with(const std::string& part, const std::string& by) {
    std::string text = whole;
    const auto at = text.find(part);
    REQUIRE(at != std::string::npos);
    return text.replace(at, part.size(), by);
}
/// Reading `whole` with one part replaced is refused with this line and this text.
void check_mistake(const std::string& part, const std::string& by, int line, const std::string& says) {
    test_support::check_mistake<io_error>([](const std::string& text) { return read_choice<3>(text); }, whole, part, by,
                                          line, says);
}

}  // namespace

TEST_CASE("a text says all of a choice", "[any]") {
    const SimulationChoice<3> choice = read_choice<3>(whole);
    CHECK(choice.precision == "double");
    CHECK(choice.domain.lower[0] == -1);
    CHECK(choice.domain.upper[1] == 2);
    CHECK(choice.domain.cell_size == 0.0625);
    CHECK(choice.domain.periodic == std::array{true, false, false});
    CHECK(choice.transfer == "aflip");
    CHECK(choice.transfer_parameters == std::vector<NamedNumber>{{"alpha", 0.5}});
    CHECK(choice.kernel == "cubic_b_spline");
    CHECK(choice.force == "weight_gradient");
    REQUIRE(choice.materials.size() == 2);
    CHECK(choice.materials[0] == MaterialChoice{"sand", {{"friction_angle", 30}}, {{"mu", 1e4}}});
    CHECK(choice.materials[1] == MaterialChoice{"fluid", {}, {}});
    REQUIRE(choice.boundary->size() == 5);
    const auto& walls = std::get<Walls<double, 3>>((*choice.boundary)[0]);
    CHECK(walls.lower[0] == -1);
    CHECK(walls.nodes_behind == NodesBehind::mirrored);
    CHECK(walls.at_lower[0].contact == Contact::none);  // a periodic axis
    CHECK(walls.at_lower[1].contact == Contact::stick);
    CHECK(walls.at_upper[1].contact == Contact::slip);
    CHECK(walls.at_upper[1].friction == 0.25);
    CHECK(walls.at_upper[2].friction == 0.5);
    const auto& ball = std::get<Collider<Sphere<double, 3>>>((*choice.boundary)[1]);
    CHECK(ball.shape.radius == 0.25);
    CHECK(ball.position[2] == 0.5);
    CHECK(ball.linear_velocity[1] == -1);
    CHECK(ball.friction == 0.125);
    CHECK(ball.contact == Contact::separate);
    const auto& box = std::get<Collider<Box<double, 3>>>((*choice.boundary)[2]);
    CHECK(box.shape.half_extents[2] == 0.125);
    CHECK((matrix_of(box.rotation) * Vec<double, 3>{1, 0, 0})[2] == Approx(-1));
    CHECK(box.angular_velocity[1] == 1);
    CHECK(box.thickness == 0.01);
    CHECK(box.thickness_in_cells == 1);
    CHECK(std::get<Collider<HalfSpace<double, 3>>>((*choice.boundary)[3]).shape.outward[1] == 0.8);
    CHECK(std::get<Collider<Capsule<double, 3>>>((*choice.boundary)[4]).shape.half_length == 0.5);
    CHECK((*choice.gravity)[1] == -3.7);
    CHECK(choice.fixed_time_step == 1e-4);
    CHECK(choice.most_steps_between_sorts == 50);
    CHECK(choice.threads == 3);
}

TEST_CASE("a choice is read from its own text, and a short text has defaults", "[any]") {
    const std::string text = choice_text(read_choice<3>(whole));
    CHECK(choice_text(read_choice<3>(text)) == text);
    const auto least = read_choice<2>(R"({"domain": {"upper": [1, 1], "cell_size": 0.1}})");
    CHECK(least.transfer == "apic");
    CHECK(least.materials == std::vector<MaterialChoice>{MaterialChoice{}});
    CHECK(!least.boundary);
    CHECK(!least.gravity);
    CHECK(choice_text(read_choice<2>(choice_text(least))) == choice_text(least));
    const auto turned = read_choice<2>(
        R"({"domain": {"upper": [1, 1], "cell_size": 0.1}, "boundary": [{"shape": "box", "rotation": 90}]})");
    CHECK((matrix_of(std::get<Collider<Box<double, 2>>>((*turned.boundary)[0]).rotation) * Vec<double, 2>{1, 0})[1] ==
          Approx(1));
    SimulationChoice<3> meshed;
    meshed.boundary = {Collider<DistanceGrid<double, 3>>{}};
    check_refused<parameter_error>([&] { choice_text(meshed); }, "A grid of distances is no text");
    CHECK(read_choice<3>(JsonValue::parse(R"({"domain": {"upper": [1, 1, 1], "cell_size": 0.1}, "bodies": []})"),
                         {"bodies"})
              .domain.cell_size == 0.1);
}

TEST_CASE("a program reads shapes of its own", "[any]") {
    const ShapeReader<3> plate{
        "plate", [](const JsonValue& json, const Domain<3>& domain) -> BoundaryPart<3> {
            return read_collider<Box<double, 3>>(json, {"side"}, [&](Collider<Box<double, 3>>& box) {
                box.shape.half_extents = {json.at("side").number() / 2, domain.cell_size, json.at("side").number() / 2};
            });
        }};
    const auto read = [&](const std::string& text) { return read_choice<3>(JsonValue::parse(text), {}, {plate}); };
    const std::string part = R"("shape": "box", "half_extents": [0.5, 0.25, 0.125])";
    const auto choice = read(with(part, R"("shape": "plate", "side": 0.5)"));
    const auto& box = std::get<Collider<Box<double, 3>>>((*choice.boundary)[2]);
    CHECK(box.shape.half_extents[0] == 0.25);
    CHECK(box.shape.half_extents[1] == 0.0625);
    CHECK(box.contact == Contact::stick);
    CHECK(box.angular_velocity[1] == 1);
    check_refused<io_error>([&] { read(with(part, R"("shape": "plate", "size": 0.5)")); },
                            "line 20, size: a plate has no such number; it has: shape, contact, side, half_extents");
    check_refused<io_error>([&] { read(with(part, R"("shape": "plate", "side": 0)")); },
                            "line 20, boundary[2]: The half extent of a box is 0 m");
    check_refused<io_error>(
        [&] { read(with("capsule", "pipe")); },
        "line 23, shape: 'pipe' is no shape; there are: walls, half_space, sphere, box, capsule, plate");
    check_refused<io_error>(
        [] { read_choice<2>(R"({"domain": {"upper": [1, 1], "cell_size": 0.1}, "boundary": [{"shape": "mesh"}]})"); },
        "line 1, shape: a mesh is a solid in three dimensions; in two there are: walls, half_space, sphere");
}

TEST_CASE("a mistake in the text of a choice is told with its line", "[any]") {
    check_mistake("\"dimension\": 3", "\"dimension\": 2", 2, "in 3 dimensions");
    check_mistake("\"double\"", "\"half\"", 3, "\"float\" or \"double\"");
    check_mistake("\"double\"", "8", 3, "a text in quotes");
    check_mistake("[1, 2, 1]", "[1, 2]", 5, "3 numbers in brackets");
    check_mistake("[1, 2, 1]", "[1, -2, 1]", 5, "upper must be above lower");
    check_mistake("0.0625", "0", 5, "cell size is 0 m");
    check_mistake("\"cell_size\": 0.0625", "\"cel_size\": 0.0625", 5, "lower, upper, cell_size, periodic");
    check_mistake(", \"cell_size\": 0.0625", "", 4, "'cell_size' is missing");
    check_mistake("[true, false, false]", "[true, 0, false]", 6, "true or false");
    check_mistake("\"transfer\"", "\"tranfer\"", 8, "there is no such member");
    check_mistake("\"alpha\": 0.5", "\"alpha\": \"much\"", 9, "give a number");
    check_mistake("\"kernel\"", "\"transfer\"", 10, "there twice");
    check_mistake("\"name\": \"sand\", ", "", 13, "'name' is missing");
    check_mistake("{\"name\": \"fluid\"}", "{\"name\": \"fluid\", \"colour\": 1}", 14, "name, properties, parameters");
    check_mistake("\"contact\": \"slip\"", "\"contact\": \"slide\"", 17, "stick, slip, separate, none");
    check_mistake("y_lower", "w_lower", 18, "this is no face");
    check_mistake("\"mirrored\"", "\"mirror\"", 18, "\"held\" or \"mirrored\"");
    check_mistake("\"shape\": \"sphere\"", "\"shape\": \"ball\"", 19, "walls, half_space, sphere, box, capsule");
    check_mistake("\"radius\": 0.25", "\"radius\": -1", 19, "radius of a sphere is -1 m");
    check_mistake("\"radius\": 0.25", "\"size\": 1", 19, "a sphere has no such number; it has: shape, contact, radius");
    check_mistake("\"degrees\": 90", "\"radians\": 1", 20, "axis, degrees");
    check_mistake("\"stick\", \"angular", "\"stick\", \"friction\": -1, \"angular", 21, "friction");
    check_mistake("[0.6, 0.8, 0]", "[1, 1, 0]", 22, "outward direction");
    check_mistake("-3.7", "null", 25, "give a number");
    check_mistake("\"fixed_time_step\": 1e-4", "\"fixed_time_step\": -1", 26, "not negative");
    check_mistake("50", "2.5", 27, "a whole number");
    check_mistake("\"threads\": 3", "\"threads\": 1e9", 28, "at most 65536");
    check_refused<io_error>([] { read_choice<3>(with("\"gravity\": [0, -3.7, 0],", "\"gravity\": [0, -3.7, 0]")); },
                            "line 26: ");
    check_refused<io_error>([] { read_choice<3>(whole + "}"); }, "line 29: ");
}

TEST_CASE("a material is made of its properties, then of its parameters", "[any]") {
    const auto sand = detail::material_of<Sand<double>>({{"young", 2e5}, {"friction_angle", 40}}, {{"lambda", 7e4}});
    SandProperties grains;
    grains.young = 2e5;
    grains.friction_angle = degrees(40);
    const auto expected = Sand<double>::from_properties(grains);
    CHECK(sand.mu == expected.mu);
    CHECK(sand.friction_angle == expected.friction_angle);
    CHECK(sand.lambda == 7e4);
    CHECK(detail::material_of<FixedCorotated<float>>({{"young", 1e4}}, {}).mu ==
          FixedCorotated<float>::from_young_poisson(1e4, 0.3).mu);
    CHECK(detail::material_of<PlasticVolume<MohrCoulomb<double>>>({{"cohesion", 5}}, {}).cohesion == 5);
    check_refused<parameter_error>([] { detail::material_of<NoStress<double>>({{"young", 1}}, {}); },
                                   "there are: none");
}

TEST_CASE("every property of a material can be given by name", "[any]") {
    // The lists of names are not beside the properties; a new property makes its struct larger than its list.
    const auto check = []<class P>(const P& of) {
        const auto size = std::apply([](const auto&... each) { return sizeof...(each); }, detail::property_list(of));
        CHECK(size * sizeof(double) == sizeof(P));
    };
    check(SandProperties{});
    check(SnowProperties{});
    check(FluidProperties{});
    check(VonMisesProperties{});
    check(NaccProperties{});
    check(MohrCoulombProperties{});
    check(ModifiedCamClayProperties{});
    check(detail::YoungPoisson{});
    [&]<template <class> class... M>(OfferedMaterials<M...>) {
        constexpr bool all = (!std::is_void_v<detail::properties_t<M<float>>> && ...);
        CHECK(all);
    }(CommonMaterials{});
}

#ifndef FIRN_TEST_QUICK
TEST_CASE("a state tells the choice of its run", "[any]") {
    Simulation simulation(Domain<2>{{0, -1}, {2, 1}, 0.125}, Sand<double>::from_properties({.young = 3e4}), Aflip<>{});
    simulation.gravity = {1, -2};
    simulation.fixed_time_step = 1e-4;
    simulation.add(sample_box<2>({0.5, -0.5}, {1, 0}, {.spacing = 0.05}), 1000);
    const auto state = state_of(simulation);
    const SimulationChoice<2> choice = choice_of<2>(state);
    CHECK(choice.precision == "double");
    CHECK(choice.transfer == "aflip");
    CHECK(choice.domain.lower[1] == -1);
    CHECK(choice.domain.cell_size == 0.125);
    CHECK((*choice.gravity)[0] == 1);
    CHECK(choice.fixed_time_step == 1e-4);
    REQUIRE(choice.materials.size() == 1);
    const auto sand = detail::material_of<Sand<double>>({}, choice.materials[0].parameters);
    CHECK(sand.mu == simulation.material().mu);
    CHECK(sand.friction_angle == simulation.material().friction_angle);
    check_refused<io_error>([&] { choice_of<3>(state); }, "has 2 dimensions");
    auto less = state;
    less.parameters.clear();
    check_refused<io_error>([&] { choice_of<2>(less); }, "no parameter grid/lower");
}
#endif

}  // namespace choice_tests
