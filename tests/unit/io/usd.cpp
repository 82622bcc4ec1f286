/// \file USD stages: the text of a stage of one time and of one with many; the same in the background; what is refused.
#include "support/catch.hpp"
#include <firn/io/mesh_state.hpp>
#include <firn/io/usd_series.hpp>

#include "example_state.hpp"

#include <limits>

using states::Folder;

namespace usd_tests {

using Names = std::set<std::string>;
using Prims = std::vector<firn::UsdPrim<float>>;

namespace {

firn::State<float> water_at(double time, std::size_t count = 2) {
    firn::State<float> state;
    state.time = time;
    state.fields = {{"position", "m", 3, {0.1F, 0.2F, -1e-9F, 1, float(time), 0}},
                    {"velocity", "m/s", 3, {1, 2, 3, -4, 0.5F, 6}},
                    {"volume", "m^3", 1, {1e-3F, 8e-3F}},
                    {"F", "1", 4, {1, 2, 3, 4, 5, 6, 7, 8}}};
    state.id = {5'000'000'000, 7};
    state.body = {0, 0};
    for (auto& field : state.fields) field.values.resize(count * std::size_t(field.components));
    state.id.resize(count);
    state.body.resize(count);
    return state;
}

firn::State<float> cloth_at(double time) {
    return firn::state_of<float>(firn::TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, time}}, {{0, 1, 2}}}, time);
}

Prims prims_at(double time) { return {{"water", water_at(time)}, {"cloth", cloth_at(time)}}; }

}  // namespace

TEST_CASE("A stage of one time has its prims, with all digits of their values", "[io][usd]") {
    const Folder folder;
    firn::write_usd(folder / "my run.usda", prims_at(0.125), {.primvars = {}});
    CHECK(states::bytes_of(folder / "my run.usda") == R"(#usda 1.0
(
    defaultPrim = "my_run"
    endTimeCode = 3
    framesPerSecond = 24
    metersPerUnit = 1
    startTimeCode = 3
    timeCodesPerSecond = 24
    upAxis = "Y"
)

def Xform "my_run"
{
    def Points "water"
    {
        float3[] extent
        float3[] extent.timeSamples = {
            3: [(0.05, 0.024999999, -0.1), (1.1, 0.25, 0.1)],
        }
        int64[] ids
        int64[] ids.timeSamples = {
            3: [5000000000, 7],
        }
        point3f[] points
        point3f[] points.timeSamples = {
            3: [(0.1, 0.2, -1e-09), (1, 0.125, 0)],
        }
        vector3f[] velocities
        vector3f[] velocities.timeSamples = {
            3: [(1, 2, 3), (-4, 0.5, 6)],
        }
        float[] widths (
            interpolation = "vertex"
        )
        float[] widths.timeSamples = {
            3: [0.1, 0.2],
        }
    }
    def Mesh "cloth"
    {
        uniform bool doubleSided = 1
        uniform token subdivisionScheme = "none"
        float3[] extent
        float3[] extent.timeSamples = {
            3: [(0, 0, 0), (1, 1, 0.125)],
        }
        int[] faceVertexCounts
        int[] faceVertexCounts.timeSamples = {
            3: [3],
        }
        int[] faceVertexIndices
        int[] faceVertexIndices.timeSamples = {
            3: [0, 1, 2],
        }
        point3f[] points
        point3f[] points.timeSamples = {
            3: [(0, 0, 0), (1, 0, 0), (0, 1, 0.125)],
        }
    }
}
)");
}

TEST_CASE("Primvars have the types of vectors and of rows of numbers; points in the plane have z = 0", "[io][usd]") {
    const Folder folder;
    firn::State<double> state;
    state.dimension = 2;
    state.fields = {{"position", "m", 2, {1.0 / 3, 2}},
                    {"velocity", "m/s", 2, {3, 4}},
                    {"F", "1", 4, {1, 2, 3, 0.1}},
                    {"mass", "kg", 1, {0.25}}};
    state.id = {0};
    state.body = {0};
    firn::write_usd(folder / "a.usda", state,
                    {.time_codes_per_second = 30, .width = 0.5, .primvars = {"F", "mass", "velocity"}});
    const std::string text = states::bytes_of(folder / "a.usda");
    for (const char* part :
         {"    timeCodesPerSecond = 30\n", "    def Points \"particles\"\n", "0: [(0.33333334, 2, 0)],",
          "velocities.timeSamples = {\n            0: [(3, 4, 0)],", "widths.timeSamples = {\n            0: [0.5],",
          "0: [(0.08333334, 1.75, -0.25), (0.5833334, 2.25, 0.25)],",
          "float[] primvars:F_3 (\n            interpolation = \"vertex\"\n        )\n",
          "primvars:F_1.timeSamples = {\n            0: [2],", "primvars:F_3.timeSamples = {\n            0: [0.1],",
          "primvars:mass.timeSamples = {\n            0: [0.25],",
          "vector3f[] primvars:velocity (\n            interpolation = \"vertex\"\n        )\n",
          "primvars:velocity.timeSamples = {\n            0: [(3, 4, 0)],"}) {
        INFO(part);
        CHECK(states::holds(text, part));
    }
}

TEST_CASE("A series of USD is a stage with the files of its times as clips, after every write", "[io][usd][series]") {
    const Folder folder;
    firn::UsdSeries series(folder.path(), "run");
    CHECK(series.path() == folder / "run.usda");
    CHECK(series.write(prims_at(0)) == folder / "run_0000.usda");
    series.write(prims_at(0.125));
    CHECK(states::bytes_of(folder / "run.usda") == R"(#usda 1.0
(
    customLayerData = {
        string firn_series = '''{
  "file-series-version": "1.0",
  "files": [
    {"name": "run_0000.usda", "time": 0},
    {"name": "run_0001.usda", "time": 0.125}
  ]
}
'''
    }
    defaultPrim = "run"
    endTimeCode = 3
    framesPerSecond = 24
    metersPerUnit = 1
    startTimeCode = 0
    timeCodesPerSecond = 24
    upAxis = "Y"
)

def Xform "run" (
    clips = {
        dictionary default = {
            double2[] active = [(0, 0), (3, 1)]
            asset[] assetPaths = [@./run_0000.usda@, @./run_0001.usda@]
            asset manifestAssetPath = @./run.usda@
            string primPath = "/run"
            double2[] times = [(0, 0), (3, 3)]
        }
    }
)
{
    def Points "water"
    {
        float3[] extent
        int64[] ids
        point3f[] points
        vector3f[] velocities
        float[] widths (
            interpolation = "vertex"
        )
    }
    def Mesh "cloth"
    {
        uniform bool doubleSided = 1
        uniform token subdivisionScheme = "none"
        float3[] extent
        int[] faceVertexCounts
        int[] faceVertexIndices
        point3f[] points
    }
}
)");
    // Each file is what write_usd() writes, but for the name of its root.
    firn::write_usd(folder / "run.one.usda", prims_at(0.125));
    std::string alone = states::bytes_of(folder / "run.one.usda");
    for (std::size_t at; (at = alone.find("run_one")) != std::string::npos;) alone.replace(at, 7, "run");
    CHECK(alone == states::bytes_of(folder / "run_0001.usda"));
}

TEST_CASE("USD in the background is that in the foreground, byte for byte, and goes on", "[io][usd][series]") {
    const Folder folder;
    firn::UsdSeries before(folder / "fore", "run");
    {
        firn::BackgroundSeries<float, firn::UsdSeries> series(folder / "back", "run");
        for (int i = 0; i < 6; ++i) {
            before.write(prims_at(i));
            series.write(prims_at(i));
        }
        series.finish();
        CHECK(series.spare().size() == 2);
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder / "fore"))
        CHECK(states::bytes_of(entry.path()) == states::bytes_of(folder / "back" / entry.path().filename().string()));

    firn::UsdSeries on(folder / "back", "run");
    on.go_on_from(3.5);
    CHECK(on.write(prims_at(4)) == folder / "back/run_0004.usda");
    CHECK(on.entries().size() == 5);
    CHECK(firn::detail::read_usd_list(on.path()) == on.entries());
    CHECK_FALSE(std::filesystem::exists(folder / "back/run_0005.usda"));
    // One begun afresh replaces the old one's files.
    firn::UsdSeries(folder / "back", "run").write(prims_at(9));
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "back")) files += entry.is_regular_file();
    CHECK(files == 2);
}

TEST_CASE("The times of rounded steps are whole frames, and others are as they are", "[io][usd]") {
    const Folder folder;
    firn::UsdSeries series(folder.path(), "run");
    double time = 0;
    for (int k = 0; k < 7; ++k) {
        if (k > 0) time += 1.0 / 24;
        series.write(water_at(time));
    }
    REQUIRE(24 * time != 6);  // the sum is rounded
    series.write(water_at(6.25 / 24));
    CHECK(states::holds(states::bytes_of(series.path()),
                        "active = [(0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (6, 6), (6.25, 7)]"));
    CHECK(states::holds(states::bytes_of(folder / "run_0006.usda"), "endTimeCode = 6\n"));
    CHECK_THROWS_AS(series.write(water_at(6.25 / 24 + 1e-20)), firn::parameter_error);
}

TEST_CASE("Prims may lose all their points and facets, and get some again", "[io][usd][series]") {
    const Folder folder;
    firn::UsdSeries series(folder.path(), "run");
    auto torn = cloth_at(1);
    torn.facets.clear();
    series.write(Prims{{"water", water_at(0, 0)}, {"cloth", cloth_at(0), firn::UsdType::mesh}});
    series.write(Prims{{"water", water_at(1)}, {"cloth", torn, firn::UsdType::mesh}});
    const std::string first = states::bytes_of(folder / "run_0000.usda");
    CHECK(states::holds(first, "point3f[] points.timeSamples = {\n            0: [],"));
    CHECK(states::holds(first,
                        "[(3.4028235e+38, 3.4028235e+38, 3.4028235e+38), "
                        "(-3.4028235e+38, -3.4028235e+38, -3.4028235e+38)]"));
    CHECK(states::holds(states::bytes_of(folder / "run_0001.usda"),
                        "faceVertexCounts.timeSamples = {\n            24: [],"));
}

TEST_CASE("What cannot be a stage is refused, and leaves the stage as it was", "[io][usd]") {
    const Folder folder;
    firn::UsdSeries series(folder.path(), "run");
    series.write(prims_at(1));
    const std::string stage = states::bytes_of(series.path());
    const auto refused = [&](const Prims& prims) {
        return states::message<firn::parameter_error>([&] { series.write(prims); });
    };
    CHECK(states::holds(refused({}), "no prims"));
    CHECK(states::holds(refused(prims_at(1)), "goes to 1 s already"));
    CHECK(states::holds(refused({{"water", water_at(2)}}), "differ from those"));
    CHECK(states::holds(refused({{"water", water_at(2)}, {"cloth", cloth_at(3)}}), "states of one time"));
    CHECK(states::holds(refused({{"water", water_at(2)}, {"water", cloth_at(2)}}), "'water'"));
    for (const char* name : {"", "1st", "a b", "a/b", "Wäsche", "a.b"})
        CHECK(states::holds(refused({{name, water_at(2)}}), "letters, digits"));
    auto bad = prims_at(2);
    bad[0].state.fields[1].values[3] = std::numeric_limits<float>::quiet_NaN();
    CHECK(states::holds(refused(bad), "The field 'velocity' of particle 7 is nan"));
    bad = prims_at(2);
    bad[1].state.fields[0].values[8] = -std::numeric_limits<float>::infinity();
    CHECK(states::holds(refused(bad), "The field 'position' of particle 2 is -inf"));
    bad = prims_at(2);
    bad[0].state.fields[3].values[0] = std::numeric_limits<float>::quiet_NaN();  // is not written
    bad[0].state.fields.erase(bad[0].state.fields.begin() + 2);
    CHECK(states::holds(refused(bad), "no field 'volume'"));
    CHECK(folder.names() == Names{"run.usda", "run_0000.usda"});
    CHECK(states::bytes_of(series.path()) == stage);

    const auto refused_with = [&](const firn::UsdOptions& options) {
        return states::message<firn::parameter_error>(
            [&] { firn::write_usd(folder / "a.usda", water_at(0), options); });
    };
    CHECK(states::holds(refused_with({.time_codes_per_second = 0}), "time_codes_per_second is 0"));
    CHECK(states::holds(refused_with({.width = -1}), "UsdOptions::width is -1"));
    CHECK(states::holds(refused_with({.primvars = {"heat"}}), "no field 'heat'"));
    CHECK(states::holds(refused_with({.primvars = {"F", "F"}}), "'F' twice"));
    for (const char* name : {"a@b", "a'b", "a\"b", "a\\b"})
        CHECK_THROWS_AS(firn::UsdSeries(folder.path(), name), firn::parameter_error);
    auto flat = water_at(2);
    flat.dimension = 2;
    for (auto& field : flat.fields)
        if (field.components == 3) field = {field.name, field.unit, 2, {1, 2, 3, 4}};
    flat.facets = {0, 1};
    CHECK(states::holds(refused({{"water", flat, firn::UsdType::mesh}}), "in three"));
    CHECK_THROWS_AS(firn::write_usd(folder / "no/a.usda", water_at(0)), firn::io_error);
    states::put_bytes(folder / "other.usda", "#usda 1.0\n");
    CHECK(states::holds(states::message<firn::io_error>([&] { firn::UsdSeries(folder.path(), "other").go_on_from(0); }),
                        "not written by a UsdSeries"));
}

}  // namespace usd_tests
