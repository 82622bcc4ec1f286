/// \file Series of PLY, OBJ and splats: named, listed, continued and written in the background as states are; and
/// states that are made for them.
#include "support/catch.hpp"
#include <firn/io/joined_states.hpp>
#include <firn/io/mesh_state.hpp>
#include <firn/io/obj_series.hpp>
#include <firn/io/ply_series.hpp>
#include <firn/io/splat_series.hpp>

#include "example_state.hpp"

#include <limits>

using states::Folder;

namespace graphics_series_tests {

using Names = std::set<std::string>;

namespace {

/// Two triangles of cloth at some time, whose points move and of which one is torn off at the time 2.
firn::State<float> cloth_at(int time) {
    firn::State<float> state;
    state.time = time;
    state.fields = {{"position", "m", 3, {0, 0, 0, 1, 0, 0, 0, 2, 0, 1, 1, float(time)}},
                    {"velocity", "m/s", 3, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}},
                    {"mass", "kg", 1, {0.5F, 1.5F, 2.25F, float(time)}},
                    {"volume", "m^3", 1, {1e-3F, 1e-3F, 8e-3F, 1e-3F}}};
    state.id = {3, 4, 7, 8};
    state.body = {0, 0, 0, 0};
    state.facets = {0, 1, 2};
    if (time < 2) state.facets.insert(state.facets.end(), {1, 3, 2});
    return state;
}

template <class Series>
void check_background(const Folder& folder, const std::string& ending, const typename Series::Options& options) {
    Series before(folder / "fore", "run", options);
    firn::BackgroundSeries<float, Series> series(folder / "back", "run", options);
    for (int i = 0; i < 12; ++i) {
        CHECK(before.write(cloth_at(i)).filename() ==
              "run_00" + std::string(i < 10 ? "0" : "") + std::to_string(i) + ending);
        series.write(cloth_at(i));
    }
    series.finish();
    CHECK(series.size() == 12);
    CHECK(series.path() == folder / "back" / ("run" + ending + ".series"));
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "fore")) {
        CHECK(states::bytes_of(entry.path()) == states::bytes_of(folder / "back" / entry.path().filename().string()));
        ++files;
    }
    CHECK(files == 13);
    const auto listed = firn::read_series(series.path());
    REQUIRE(listed.size() == 12);
    for (int i = 0; i < 12; ++i) CHECK(listed[std::size_t(i)].time == i);
    CHECK(series.spare().size() == 4);  // the memory of a state that was written
}

}  // namespace

TEST_CASE("PLY, OBJ and splats in the background are those in the foreground, byte for byte", "[io][series]") {
    const Folder folder;
    SECTION("PLY") { check_background<firn::PlySeries>(folder, ".ply", {}); }
    SECTION("OBJ") { check_background<firn::ObjSeries>(folder, ".obj", {}); }
    SECTION("splats") { check_background<firn::SplatSeries>(folder, ".ply", {}); }
}

TEST_CASE("A PLY of a series is what write_ply writes of its fields, by default of the velocity", "[io][series]") {
    const Folder folder;
    const auto of_series = firn::PlySeries(folder.path(), "plain").write(cloth_at(1));
    firn::write_ply(folder / "alone.ply", cloth_at(1), {"velocity"});
    CHECK(states::bytes_of(of_series) == states::bytes_of(folder / "alone.ply"));
    CHECK(states::holds(states::bytes_of(of_series),
                        "property float vx\nproperty float vy\nproperty float vz\nelement face 2"));
    const auto chosen = firn::PlySeries(folder.path(), "chosen", {.fields = {"mass"}}).write(cloth_at(1));
    CHECK(states::holds(states::bytes_of(chosen), "property uint id\nproperty float mass\nelement face 2"));
}

TEST_CASE("The surfaces of an OBJ series move, and lose their facets", "[io][series]") {
    const Folder folder;
    firn::ObjSeries series(folder.path(), "cloth");
    for (int i = 0; i < 3; ++i) series.write(cloth_at(i));
    for (int i = 0; i < 3; ++i) {
        const auto mesh = firn::read_obj(folder / series.entries()[std::size_t(i)].file);
        REQUIRE(mesh.vertices.size() == 4);
        CHECK(mesh.vertices[3][2] == i);
        CHECK(mesh.triangles.size() == (i < 2 ? 2 : 1));
        CHECK(mesh.triangles[0] == std::array<std::int32_t, 3>{0, 1, 2});
    }
}

TEST_CASE("A mesh becomes a state that is written as the mesh", "[io]") {
    const Folder folder;
    const firn::TriangleMesh mesh{{{0.1, 1.0 / 3, 1e-9}, {1, 0, 0}, {0, 1, 7}}, {{2, 1, 0}}};
    const auto state = firn::state_of<double>(mesh, 0.25);
    CHECK_NOTHROW(firn::check_state(state));
    CHECK(state.time == 0.25);
    firn::write_obj(folder / "state.obj", state);
    firn::write_obj(folder / "mesh.obj", mesh);
    CHECK(states::bytes_of(folder / "state.obj") == states::bytes_of(folder / "mesh.obj"));
    CHECK(firn::state_of(firn::TriangleMesh{}).size() == 0);
}

TEST_CASE("Series of several formats and names share a folder; a new one replaces its own files only", "[io][series]") {
    const Folder folder;
    {
        firn::PlySeries ply(folder.path(), "run");
        firn::ObjSeries obj(folder.path(), "run");
        firn::SplatSeries splats(folder.path(), "run_splats");
        for (int i = 0; i < 2; ++i) {
            ply.write(cloth_at(i));
            obj.write(cloth_at(i));
            splats.write(cloth_at(i));
        }
    }
    firn::PlySeries(folder.path(), "run").write(cloth_at(5));
    CHECK(folder.names() == Names{"run_0000.ply", "run.ply.series", "run_0000.obj", "run_0001.obj", "run.obj.series",
                                  "run_splats_0000.ply", "run_splats_0001.ply", "run_splats.ply.series"});
    firn::ObjSeries obj(folder.path(), "run");
    obj.go_on_from(0.5);
    obj.write(cloth_at(3));
    CHECK(firn::read_series(obj.path()) == std::vector<firn::SeriesEntry>{{"run_0000.obj", 0}, {"run_0001.obj", 3}});
    // A list that another format's series has left is not continued.
    std::filesystem::copy(folder / "run.obj.series", folder / "wrong.ply.series");
    CHECK_THROWS_AS(firn::PlySeries(folder.path(), "wrong").go_on_from(1), firn::io_error);
}

TEST_CASE("What a series cannot write leaves the files before it, and no other", "[io][series]") {
    const Folder folder;
    firn::PlySeries ply(folder.path(), "run");
    firn::ObjSeries obj(folder.path(), "run");
    firn::SplatSeries splats(folder.path(), "splats");
    ply.write(cloth_at(0));
    obj.write(cloth_at(0));
    splats.write(cloth_at(0));
    const Names names = folder.names();
    auto broken = cloth_at(1);
    broken.fields[1].values[4] = std::numeric_limits<float>::quiet_NaN();
    CHECK(states::holds(states::message<firn::parameter_error>([&] { ply.write(broken); }),
                        "The field 'velocity' of particle 4 is nan"));
    broken.fields[0].values[4] = std::numeric_limits<float>::infinity();
    CHECK_THROWS_AS(obj.write(broken), firn::parameter_error);
    CHECK(states::holds(states::message<firn::parameter_error>([&] { splats.write(broken); }),
                        "The field 'position' of particle 4 is inf"));
    CHECK(folder.names() == names);
    CHECK(ply.write(cloth_at(1)).filename() == "run_0001.ply");

    states::put_bytes(folder / "file", "mine");
    CHECK_THROWS_AS(firn::PlySeries(folder / "file", "run"), firn::io_error);
    CHECK_THROWS_AS(firn::PlySeries(folder.path(), "a/b"), firn::parameter_error);
}

TEST_CASE("Sets without particles are written as empty files", "[io][series]") {
    const Folder folder;
    auto none = cloth_at(0);
    for (auto& field : none.fields) field.values.clear();
    none.id.clear();
    none.body.clear();
    none.facets.clear();
    CHECK(states::holds(states::bytes_of(firn::PlySeries(folder.path(), "a").write(none)), "element vertex 0\n"));
    CHECK(states::holds(states::bytes_of(firn::SplatSeries(folder.path(), "b").write(none)), "element vertex 0\n"));
    CHECK(states::bytes_of(firn::ObjSeries(folder.path(), "c").write(none)) == "# particles, positions in metres\n");
}

TEST_CASE("Joined states have the points and facets of all, and the fields that all have", "[io]") {
    auto other = cloth_at(1);
    other.fields.erase(other.fields.begin() + 2);
    other.fields.push_back({"J", "1", 1, {1, 2, 3, 4}});
    const auto first = cloth_at(1);
    const auto all = firn::joined(std::vector{first, other});
    CHECK_NOTHROW(firn::check_state(all));
    CHECK(all.size() == 8);
    CHECK(all.time == 1);
    CHECK(all.id == std::vector<std::int64_t>{0, 1, 2, 3, 4, 5, 6, 7});
    CHECK(all.find("mass") == nullptr);
    CHECK(all.find("J") == nullptr);
    CHECK(all.field("velocity").values[12 + 5] == other.fields[1].values[5]);
    CHECK(all.field("set").values == std::vector<float>{0, 0, 0, 0, 1, 1, 1, 1});
    CHECK(all.facets == std::vector<std::int64_t>{0, 1, 2, 1, 3, 2, 4, 5, 6, 5, 7, 6});
    CHECK_THROWS_AS(firn::joined(std::vector{first, cloth_at(0)}), firn::parameter_error);
    CHECK_THROWS_AS(firn::joined(std::vector<firn::State<float>>{}), firn::parameter_error);
}

}  // namespace graphics_series_tests
