/// \file Scene files: what they say, and the line of each mistake, before anything runs.
#include "../../../examples/support/scene_file.hpp"

#include "support/message.hpp"
#include "support/temporary_folder.hpp"

#include <fstream>
#include <set>
#include <string>

namespace scene_file_tests {
namespace {

using test_support::check_refused;

const std::filesystem::path data = FIRN_TEST_EXAMPLES_DIR "/data";

const std::string whole = R"({
  "about": "two materials",
  "domain": {"upper": [1, 1, 1], "cell_size": 0.1},
  "materials": [{"name": "sand"}, {"name": "fluid"}],
  "boundary": [
    {"shape": "walls"},
    {"shape": "sphere", "radius": 0.1, "position": [0.5, 0.2, 0.5]}
  ],
  "spacing": 0.04, "pattern": "lattice",
  "bodies": [
    {"material": "sand", "shape": "box", "lower": [0.1, 0.1, 0.1], "upper": [0.3, 0.3, 0.3], "density": 1600},
    {"material": "fluid", "shape": "ball", "centre": [0.7, 0.7, 0.7], "radius": 0.2, "density": 1000,
     "velocity": [0, -1, 0]}
  ],
  "sources": [
    {"material": "fluid", "shape": "box", "lower": [0.1, 0.8, 0.1], "upper": [0.2, 0.84, 0.2], "density": 1000,
     "velocity": [0, -2, 0], "end": 0.5}
  ],
  "sinks": [{"material": "fluid", "lower": [0, 0, 0], "upper": [0.1, 0.1, 0.1]}],
  "motions": [
    {"part": 1, "time": 0.5, "linear_velocity": [1, 0, 0]},
    {"part": 1, "time": 0.25, "angular_velocity": [0, 0, 1]}
  ],
  "end": 1, "frames": 4
})";

const std::string meshed = R"({
  "domain": {"upper": [1, 1, 1], "cell_size": 0.05},
  "boundary": [
    {"shape": "mesh", "file": "bunny.obj", "rotation": {"axis": [1, 2, 0], "degrees": 40}, "size": 0.5,
     "position": [0.5, 0.3, 0.5], "contact": "slip", "friction": 0.25, "thickness_in_cells": 0.5,
     "angular_velocity": [0, 1, 0]}
  ],
  "bodies": [
    {"shape": "mesh", "file": "bunny.obj", "rotation": {"axis": [1, 2, 0], "degrees": 40}, "size": 0.5,
     "position": [0.5, 0.3, 0.5], "density": 1000}
  ],
  "motions": [{"part": 0, "time": 0.5, "angular_velocity": [0, 0, 1]}],
  "end": 1
})";

example::Scene read(const std::string& text, double scale = 1) {
    return example::SceneReader(data, scale).read(firn::JsonValue::parse(text));
}
/// Reading `whole` with one part replaced is refused with this line and this text.
void check_mistake(const std::string& part, const std::string& by, int line, const std::string& says) {
    test_support::check_mistake<firn::io_error>([](const std::string& text_of) { return read(text_of); }, whole, part,
                                                by, line, says);
}

}  // namespace

TEST_CASE("a scene file says bodies, sources, sinks and motions", "[examples]") {
    const example::Scene scene = read(whole);
    CHECK(scene.spacing == 0.04);
    REQUIRE(scene.bodies.size() == 2);
    CHECK(scene.bodies[0].material == 0);
    CHECK(scene.bodies[0].samples.positions.size() == 125);
    CHECK(scene.bodies[0].density == 1600);
    CHECK(scene.bodies[1].velocity[1] == -1);
    REQUIRE(scene.sources.size() == 1);
    CHECK(scene.sources[0].source.rate == Approx(2 / 0.04));
    CHECK(scene.sources[0].source.end == 0.5);
    REQUIRE(scene.sinks.size() == 1);
    CHECK(scene.sinks[0].material == 1);
    REQUIRE(scene.motions.size() == 2);
    CHECK(scene.motions[0].time == 0.25);
    CHECK(scene.motions[1].linear_velocity[0] == 1);
    CHECK(scene.end == 1);
    CHECK(scene.frames == 4);
}

TEST_CASE("a mistake in a scene file is told with its line", "[examples]") {
    check_mistake("\"about\"", "\"abuot\"", 2, "there is no such member");
    check_mistake("\"cell_size\": 0.1", "\"cell_size\": -0.1", 3, "cell size is -0.1 m");
    check_mistake("\"spacing\": 0.04", "\"spacing\": 0", 9, "a number above 0");
    check_mistake("\"pattern\": \"lattice\"", "\"pattern\": \"grid\"", 9, "\"lattice\", \"jittered\" or");
    check_mistake("{\"material\": \"sand\", ", "{", 11, "'material' is missing");
    check_mistake("{\"material\": \"sand\", ", "{\"material\": \"snow\", ", 11,
                  "no such material; there are: sand, fluid");
    check_mistake("\"shape\": \"box\"", "\"shape\": \"cube\"", 11, "\"box\", \"ball\", \"mesh\" or \"points\"");
    check_mistake("\"density\": 1600", "\"density\": 0", 11, "a number above 0");
    check_mistake(", \"density\": 1600", "", 11, "'density' is missing");
    check_mistake("\"density\": 1600", "\"density\": 1600, \"colour\": 3", 11, "there is no such member here");
    check_mistake("[0.3, 0.3, 0.3]", "[0.3, 0.3]", 11, "3 numbers");
    check_mistake("[0.3, 0.3, 0.3]", "[0.3, 0.05, 0.3]", 11, "upper");
    check_mistake("[0.3, 0.3, 0.3]", "[0.3, 1.3, 0.3]", 11, "outside of the domain");
    check_mistake("\"radius\": 0.2", "\"radius\": -0.2", 12, "a number above 0");
    check_mistake("\"shape\": \"ball\"", "\"shape\": \"mesh\", \"file\": \"no.obj\"", 12, "there is no file");
    check_mistake("\"shape\": \"ball\"", "\"shape\": \"mesh\"", 12, "'file' is missing");
    check_mistake("\"end\": 0.5", "\"rate\": -1", 17, "rate");
    check_mistake("\"upper\": [0.1, 0.1, 0.1]}]", "\"upper\": [0.1, -0.1, 0.1]}]", 19, "upper");
    check_mistake("\"part\": 1", "\"part\": 0", 21, "no solid that moves");
    check_mistake("\"part\": 1", "\"part\": 2", 21, "no solid that moves; it has 2 parts");
    check_mistake("\"time\": 0.5", "\"time\": -1", 21, "not negative");
    check_mistake("\"end\": 1,", "\"end\": 0,", 24, "a number above 0");
    check_mistake("\"frames\": 4", "\"frames\": 0", 24, "1 to 100000");
    check_refused<firn::io_error>([] { read(R"({"domain": {"upper": [1, 1, 1], "cell_size": 0.1}, "end": 1})"); },
                                  "neither bodies nor sources");
}

TEST_CASE("a mesh of a scene is a solid where a body of the same mesh would be", "[examples]") {
    const example::Scene scene = read(meshed);
    const auto& solid = std::get<example::MeshSolid>((*scene.choice.boundary)[0]);
    CHECK(solid.contact == firn::Contact::slip);
    CHECK(solid.friction == 0.25);
    CHECK(solid.thickness_in_cells == 0.5);
    CHECK(solid.angular_velocity[1] == 1);
    CHECK(solid.position[1] == 0.3);
    CHECK(solid.rotation[0] == Approx(std::cos(0.5 * 40 * 3.14159265358979 / 180)));
    const auto& numbers = *solid.shape.numbers;
    CHECK(numbers.spacing == 0.025);
    const auto turned = matrix_of(solid.rotation);
    const auto distance = [&](const firn::Vec<double, 3>& x) {
        return solid.shape.signed_distance(transpose(turned) * (x - solid.position));
    };
    double deepest = 0, farthest_out = -1;
    for (const auto& x : scene.bodies[0].samples.positions) {
        deepest = std::min(deepest, distance(x));
        farthest_out = std::max(farthest_out, distance(x));
    }
    CHECK(farthest_out < 0.5 * solid.shape.uncertainty());  // all particles of the body are in the solid
    CHECK(deepest < -0.08);
    // The mesh that is drawn is that of the solid, turned back: its box has the size only when it is turned.
    REQUIRE(scene.meshes.size() == 1);
    firn::Vec<double, 3> lower{1, 1, 1}, upper{0, 0, 0};
    double off = 0;
    for (const auto& vertex : scene.meshes[0].vertices) {
        const auto x = solid.position + turned * vertex;
        off = std::max(off, std::abs(distance(x)));
        for (int a = 0; a < 3; ++a) lower[a] = std::min(lower[a], x[a]), upper[a] = std::max(upper[a], x[a]);
    }
    CHECK(off < 0.5 * solid.shape.uncertainty());
    CHECK(std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]}) == Approx(0.5).epsilon(1e-9));
    for (int a = 0; a < 3; ++a) CHECK(0.5 * (lower[a] + upper[a]) == Approx(solid.position[a]).epsilon(1e-9));
    // Its grid reaches as far as contact looks, half a cell of layer and two cells, also where cells are larger.
    const auto box = firn::bounding_box(scene.meshes[0]);
    for (int a = 0; a < 3; ++a) CHECK(numbers.lower[a] == box.lower[a] - 2.5 * 0.05);
    const auto coarse = read(meshed, 2);
    CHECK(std::get<example::MeshSolid>((*coarse.choice.boundary)[0]).shape.numbers->spacing == 0.05);
    CHECK(coarse.choice.domain.cell_size == 0.1);
    CHECK(scene.motions[0].angular_velocity[2] == 1);

    std::string text = meshed;
    text.erase(text.find("\"position\""), 28);
    const auto in_place = std::get<example::MeshSolid>((*read(text).choice.boundary)[0]);
    const auto in_file = firn::bounding_box(
        firn::rotated(firn::read_obj(data / "bunny.obj"), matrix_of(solid.rotation), firn::Vec<double, 3>{}));
    CHECK(in_place.position[1] == Approx(0.5 * (in_file.lower[1] + in_file.upper[1])));
}

TEST_CASE("a rotor may be written with a few digits", "[examples]") {
    std::string text = meshed;
    const std::string turn = R"({"axis": [1, 2, 0], "degrees": 40})";
    for (int k = 0; k < 2; ++k) text.replace(text.find(turn), turn.size(), "[0.7071068, 0, 0.7071068, 0]");
    const auto scene = read(text);
    CHECK(firn::norm(std::get<example::MeshSolid>((*scene.choice.boundary)[0]).rotation) == Approx(1).epsilon(1e-14));
    CHECK(scene.bodies[0].samples.positions.size() > 1000);
}

TEST_CASE("a mistake in a mesh of the boundary is told with its line", "[examples]") {
    const auto check = [](const std::string& part, const std::string& by, int line, const std::string& says) {
        test_support::check_mistake<firn::io_error>([](const std::string& text) { return read(text); }, meshed, part,
                                                    by, line, says);
    };
    const std::string file = R"("file": "bunny.obj", )";
    check(file, "", 4, "'file' is missing");
    check(file, R"("file": "no.obj", )", 4, "there is no file");
    check("\"mesh\"", "\"msh\"", 4, "'msh' is no shape; there are: walls, half_space, sphere, box, capsule, mesh");
    check("\"axis\"", "\"axes\"", 4, "there is no such member here; there are: axis, degrees");
    check(R"({"axis": [1, 2, 0], "degrees": 40})", "[1, 0, 1, 0]", 4, "a quaternion of length 1");
    check("\"size\": 0.5", "\"size\": 0", 4, "a number above 0");
    check("\"size\": 0.5", "\"radius\": 0.5", 4, "a mesh has no such number; it has: shape, contact, file, size");
    check("[0.5, 0.3, 0.5]", "[0.5, 0.3]", 5, "3 numbers");
    check("\"friction\": 0.25", "\"friction\": -1", 5, "The friction of a collider_distance_grid is -1");
    check("\"thickness_in_cells\": 0.5", "\"thickness_in_cells\": -5", 5, "The thickness in cells");
    check("\"slip\"", "\"slide\"", 5, "stick, slip, separate, none");
    check("\"part\": 0", "\"part\": 1", 12, "it has 1 parts");

    const TemporaryFolder folder;
    std::ofstream(folder.path() / "open.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\n";
    std::string text = meshed;
    text.replace(text.find("bunny.obj"), 9, "open.obj");
    check_refused<firn::io_error>([&] { example::SceneReader(folder.path(), 1).read(firn::JsonValue::parse(text)); },
                                  "line 4, boundary[0]: The mesh is not a closed, consistently oriented surface");
}

TEST_CASE("a scene is read at another resolution, and a file is named", "[examples]") {
    const TemporaryFolder folder;
    const auto file = folder.path() / "scene.json";
    std::ofstream(file) << whole;
    const auto count = [](const example::Scene& scene) {
        return scene.bodies[0].samples.positions.size() + scene.bodies[1].samples.positions.size();
    };
    const example::Scene coarse = example::read_scene(file, 0), fine = example::read_scene(file, 20'000);
    CHECK(double(count(fine)) == Approx(20'000).epsilon(0.1));
    CHECK(fine.choice.domain.cell_size / fine.spacing == Approx(coarse.choice.domain.cell_size / coarse.spacing));
    std::ofstream(file) << "{\n\n";
    check_refused<firn::io_error>([&] { example::read_scene(file, 0); }, "scene.json\": line 3");
    check_refused<firn::io_error>([&] { example::read_scene(folder.path() / "no.json", 0); }, "cannot be opened");
}

TEST_CASE("the scenes of the examples are valid", "[examples]") {
    std::set<std::string> names;
#ifdef FIRN_TEST_QUICK  // without the one whose mesh takes long to measure
    const auto scenes = {"two_bunnies", "eight_materials"};
#else
    const auto scenes = {"two_bunnies", "eight_materials", "snow_on_bunny"};
#endif
    for (const char* const name : scenes) {
        const auto scene = example::read_scene(data / "scenes" / (std::string(name) + ".json"), 2000);
        CHECK(!scene.bodies.empty());
        for (const auto& material : scene.choice.materials) names.insert(material.name);
    }
    CHECK(names.size() == 8);
}

}  // namespace scene_file_tests
