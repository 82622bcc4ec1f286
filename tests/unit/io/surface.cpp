/// \file firn/io/surface.hpp: a surface as a state, as PLY with its normals and fields, and as OBJ.
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>
#include <firn/io/surface.hpp>

#include "example_state.hpp"

#include <cstring>

using states::Folder;
using test_support::check_refused;

namespace {

firn::SurfaceMesh ball() {
    const std::vector<firn::Vec<double, 3>> points{{0.5, 0.25, 0.125}, {0.6, 0.25, 0.125}};
    const std::vector<firn::SurfaceField> fields{{"velocity", "m/s", 3, {1, 2, 3, 1, 2, 3}},
                                                 {"temperature", "K", 1, {280, 290}}};
    return firn::surface_of({points, std::vector<double>{1e-3}, {}, fields});
}

}  // namespace

TEST_CASE("A surface is a state, and a file of it is the same", "[io]") {
    const auto surface = ball();
    const auto state = firn::state_of<double>(surface, 1.5);
    CHECK(state.time == 1.5);
    CHECK(state.size() == surface.vertices.size());
    REQUIRE(state.facets.size() == 3 * surface.triangles.size());
    for (std::size_t k = 0; k < state.facets.size(); ++k) CHECK(state.facets[k] == surface.triangles[k / 3][k % 3]);
    for (std::size_t v = 0; v < state.size(); ++v)
        for (int a = 0; a < 3; ++a) {
            CHECK(state.field("position").values[3 * v + std::size_t(a)] == surface.vertices[v][a]);
            CHECK(state.field("normal").values[3 * v + std::size_t(a)] == surface.normals[v][a]);
        }
    CHECK(state.field("velocity").unit == "m/s");
    CHECK(state.field("temperature").values == surface.fields[1].values);

    const Folder folder;
    firn::write_state(folder / "surface.hdf", state);
    CHECK(firn::read_state<double>(folder / "surface.hdf") == state);
    firn::write_obj(folder / "surface.obj", surface);
    const auto mesh = firn::read_obj(folder / "surface.obj");
    CHECK(mesh.triangles == surface.triangles);
    CHECK(firn::signed_volume(mesh) == Approx(firn::signed_volume(surface)).epsilon(1e-6));
    auto broken = surface;
    broken.normals.pop_back();
    check_refused<firn::parameter_error>([&] { firn::write_ply(folder / "broken.ply", broken); }, "normal");
    CHECK(!std::filesystem::exists(folder / "broken.ply"));
}

TEST_CASE("A PLY file of a surface has nx, ny, nz and the fields", "[io]") {
    const auto surface = ball();
    const Folder folder;
    firn::write_ply(folder / "surface.ply", surface, 0.25);
    const std::string all = states::bytes_of(folder / "surface.ply");
    const std::string header =
        "ply\nformat binary_little_endian 1.0\ncomment positions in metres, after 0.25 seconds\nelement vertex " +
        std::to_string(surface.vertices.size()) +
        "\nproperty float x\nproperty float y\nproperty float z\nproperty uint id\nproperty float nx\n"
        "property float ny\nproperty float nz\nproperty float vx\nproperty float vy\n"
        "property float vz\nproperty float temperature\nelement face " +
        std::to_string(surface.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
    REQUIRE(all.substr(0, header.size()) == header);
    constexpr std::size_t bytes = 4 * (3 + 1 + 3 + 4);
    REQUIRE(all.size() == header.size() + surface.vertices.size() * bytes + surface.triangles.size() * 13);
    for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
        float number;
        const auto at = [&](std::size_t k) {
            std::memcpy(&number, all.data() + header.size() + bytes * v + 4 * k, 4);
            return number;
        };
        CHECK(at(0) == float(surface.vertices[v][0]));
        CHECK(at(5) == float(surface.normals[v][1]));
        CHECK(at(8) == 2);
        CHECK(at(10) == float(surface.fields[1].values[v]));
    }
}
