/// \file PLY files: the header that the format's description asks for, and every number where it belongs.
#include "support/catch.hpp"
#include <firn/io/ply.hpp>

#include "example_state.hpp"

#include <bit>
#include <cstring>
#include <limits>

using states::Folder;

namespace {

firn::State<float> triangle() {
    firn::State<float> state;
    state.time = 0.5;
    state.fields = {{"position", "m", 3, {0, 0, 0, 1, 0, 0, 0, 2, 0}},
                    {"velocity", "m/s", 3, {1, 2, 3, 4, 5, 6, 7, 8, 9}},
                    {"mass", "kg", 1, {0.5F, 1.5F, -2.25F}}};
    state.id = {3, 4, 7};
    state.body = {0, 0, 0};
    state.facets = {0, 1, 2};
    return state;
}

/// The next T, little endian.
template <class T>
T take(std::string_view& bytes) {
    static_assert(std::endian::native == std::endian::little);
    T value;
    REQUIRE(bytes.size() >= sizeof value);
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes.remove_prefix(sizeof value);
    return value;
}

}  // namespace

TEST_CASE("A PLY file holds points, the fields asked for and the triangles", "[io]") {
    const Folder folder;
    firn::write_ply(folder / "a.ply", triangle(), {"mass", "velocity"});
    const std::string all = states::bytes_of(folder / "a.ply");
    const std::string header =
        "ply\nformat binary_little_endian 1.0\ncomment positions in metres, after 0.5 seconds\nelement vertex 3\n"
        "property float x\nproperty float y\nproperty float z\nproperty uint id\nproperty float mass\n"
        "property float vx\nproperty float vy\nproperty float vz\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    REQUIRE(all.substr(0, header.size()) == header);
    std::string_view rest(all);
    rest.remove_prefix(header.size());
    const auto state = triangle();
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t a = 0; a < 3; ++a) CHECK(take<float>(rest) == state.fields[0].values[3 * i + a]);
        CHECK(take<std::uint32_t>(rest) == state.id[i]);
        CHECK(take<float>(rest) == state.fields[2].values[i]);
        for (std::size_t a = 0; a < 3; ++a) CHECK(take<float>(rest) == state.fields[1].values[3 * i + a]);
    }
    CHECK(take<std::uint8_t>(rest) == 3);
    for (std::int32_t k = 0; k < 3; ++k) CHECK(take<std::int32_t>(rest) == k);
    CHECK(rest.empty());
}

TEST_CASE("In the plane PLY points have z = 0 and facets are edges; double stays double", "[io]") {
    firn::State<double> state;
    state.dimension = 2;
    state.fields = {{"position", "m", 2, {1, 2, 1.0 / 3, 4}}, {"stress", "Pa", 4, {1, 2, 3, 4, 5, 6, 7, 8}}};
    state.id = {0, 1};
    state.body = {0, 0};
    state.facets = {1, 0};
    const Folder folder;
    firn::write_ply(folder / "a.ply", state, {"stress"});
    const std::string all = states::bytes_of(folder / "a.ply");
    CHECK(states::holds(all, "element edge 1\nproperty int vertex1\nproperty int vertex2\n"));
    CHECK(states::holds(all, "property double stress_0\n"));
    std::string_view rest(all);
    rest.remove_prefix(all.find("end_header\n") + 11);
    for (const double expected : {1.0, 2.0, 0.0}) CHECK(take<double>(rest) == expected);
    CHECK(rest.size() == (2 * 7 - 3) * 8 + 2 * 4 + 2 * 4);
}

TEST_CASE("In the plane PLY velocities have vz = 0; other vectors have the names of their fields", "[io]") {
    firn::State<float> state;
    state.dimension = 2;
    state.fields = {{"position", "m", 2, {1, 2}}, {"velocity", "m/s", 2, {3, 4}}, {"normal", "1", 2, {5, 6}}};
    state.id = {0};
    state.body = {0};
    const Folder folder;
    firn::write_ply(folder / "a.ply", state, {"velocity", "normal"});
    const std::string all = states::bytes_of(folder / "a.ply");
    CHECK(states::holds(all,
                        "property float vx\nproperty float vy\nproperty float vz\nproperty float normal_x\n"
                        "property float normal_y\nend_header\n"));
    std::string_view rest(all);
    rest.remove_prefix(all.find("end_header\n") + 11 + 16);
    for (const float expected : {3.F, 4.F, 0.F, 5.F, 6.F}) CHECK(take<float>(rest) == expected);
    CHECK(rest.empty());
}

TEST_CASE("What cannot be a PLY file is refused, and nothing is written", "[io]") {
    const Folder folder;
    CHECK_THROWS_AS(firn::write_ply(folder / "a.ply", triangle(), {"temperature"}), firn::parameter_error);
    auto far = triangle();
    far.id[2] = std::int64_t(1) << 32;
    CHECK_THROWS_AS(firn::write_ply(folder / "a.ply", far), firn::parameter_error);
    auto broken = triangle();
    broken.fields[2].values[2] = std::numeric_limits<float>::quiet_NaN();
    CHECK(states::holds(
        states::message<firn::parameter_error>([&] { firn::write_ply(folder / "a.ply", broken, {"mass"}); }),
        "The field 'mass' of particle 7 is nan"));
    broken.fields[0].values[0] = std::numeric_limits<float>::infinity();
    CHECK_THROWS_AS(firn::write_ply(folder / "a.ply", broken), firn::parameter_error);
    CHECK_THROWS_AS(firn::write_ply(folder / "no/a.ply", triangle()), firn::io_error);
    CHECK(folder.names().empty());
}

TEST_CASE("A field that cannot be a property of a PLY file, or is one already, is refused by its name", "[io]") {
    const Folder folder;
    auto state = triangle();
    for (const char* name : {"x", "my field", "vy", "position_x"}) state.fields.push_back({name, "1", 1, {1, 2, 3}});
    const auto refused = [&](const std::vector<std::string>& fields) {
        return states::message<firn::parameter_error>([&] { firn::write_ply(folder / "a.ply", state, fields); });
    };
    CHECK(states::holds(refused({"x"}), "The field 'x' would give the PLY file a second property 'x'"));
    CHECK(states::holds(refused({"my field"}), "The field 'my field' cannot be a property"));
    CHECK(
        states::holds(refused({"mass", "mass"}), "The field 'mass' would give the PLY file a second property 'mass'"));
    CHECK(states::holds(refused({"vy", "velocity"}),
                        "The field 'velocity' would give the PLY file a second property 'vy'"));
    CHECK(states::holds(refused({"velocity", "vy"}), "The field 'vy' would"));
    CHECK(states::holds(refused({"position_x", "position"}), "second property 'position_x'"));
    CHECK(folder.names().empty());
    firn::write_ply(folder / "a.ply", state, {"vy", "mass", "position"});
    CHECK(folder.names().size() == 1);
}
