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

example::Scene read(const std::string& text) {
    return example::SceneReader(data, 1).read(firn::JsonValue::parse(text));
}
/// Reading `whole` with one part replaced is refused with this line and this text.
void check_mistake(const std::string& part, const std::string& by, int line, const std::string& says) {
    test_support::check_mistake<firn::io_error>(read, whole, part, by, line, says);
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
    for (const char* const name : {"two_bunnies", "eight_materials"}) {
        const auto scene = example::read_scene(data / "scenes" / (std::string(name) + ".json"), 2000);
        CHECK(!scene.bodies.empty());
        for (const auto& material : scene.choice.materials) names.insert(material.name);
    }
    CHECK(names.size() == 8);
}

}  // namespace scene_file_tests
