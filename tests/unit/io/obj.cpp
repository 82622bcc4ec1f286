/// \file firn/io/obj.hpp: what is read is what the file says, and what cannot be read is refused with its line.
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"
#include <firn/data/inside.hpp>
#include <firn/io/obj.hpp>
#include <firn/lagrangian.hpp>

#include <limits>

using namespace firn;

namespace obj_tests {
namespace {

const std::string cube_vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";

void put(const std::filesystem::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

/// The message with which reading this text is refused, or "read".
std::string refusal(const std::string& text, bool points = false) {
    const TemporaryFolder folder;
    const auto path = folder.path() / "given.obj";
    put(path, text);
    try {
        points ? void(read_obj_points(path)) : void(read_obj(path));
    } catch (const error& e) {
        return e.what();
    }
    return "read";
}
bool holds(const std::string& text, const std::string& part) {
    INFO(text << " should hold: " << part);
    CHECK(text.find(part) != std::string::npos);
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("The bunny: vertices and triangles as counted in the file, closed, a sphere's topology, positive volume") {
    const auto mesh = read_obj(FIRN_TEST_EXAMPLES_DIR "/data/bunny.obj");
    CHECK(mesh.vertices.size() == 1839);
    CHECK(mesh.triangles.size() == 3674);  // 2 V − 4: Euler's formula for a closed surface without handles
    CHECK_NOTHROW(check_closed(mesh));
    CHECK(signed_volume(mesh) > 0);
    CHECK(mesh.vertices[0][0] == Approx(1.3019).epsilon(1e-15));
    CHECK(mesh.vertices[0][2] == Approx(2.55006).epsilon(1e-15));
}

TEST_CASE("A cube of quads, of negative indices, of vt/vn corners, with groups and CRLF: the same unit cube") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "cube.obj";
    std::string text;
    SECTION("quads") { text = cube_vertices + "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n"; }
    SECTION("negative indices count back from the face") {
        text =
            cube_vertices + "f -5 -6 -7 -8\nf -4 -3 -2 -1\nf -8 -7 -3 -4\nf -6 -5 -1 -2\nf -7 -6 -2 -3\nf -8 -4 -1 -5";
    }
    SECTION("texture and normal indices, groups, materials, comments, blanks, CRLF") {
        text = "# a cube\r\nmtllib none.mtl\r\no cube\r\n\r\n" + cube_vertices +
               "vt 0 0\r\nvn 0 0 1\r\ng a\r\nusemtl x\r\nf 4/1/1 3/1/1 2/1/1 1/1/1\r\n\tf 5//1 6//1 7//1 8//1\r\n" +
               "g b\r\ns off\r\nf 1/1 2/1 6/1 5/1\r\nf  3 4 8 7 \r\nf 2 3 7 6\r\nf 1 5 8 4\r\n";
    }
    SECTION("faces before their vertices") {
        text = "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n" + cube_vertices;
    }
    put(path, text);
    const auto mesh = read_obj(path);
    CHECK(mesh.vertices.size() == 8);
    CHECK(mesh.triangles.size() == 12);
    CHECK_NOTHROW(check_closed(mesh));
    CHECK(signed_volume(mesh) == Approx(1).epsilon(1e-15));
}

TEST_CASE("A prism over a hollow (not convex) hexagon: polygons are cut within themselves") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "prism.obj";
    // An L of three unit squares, height 2: volume 6.
    put(path,
        "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
        "v 0 0 2\nv 2 0 2\nv 2 1 2\nv 1 1 2\nv 1 2 2\nv 0 2 2\n"
        "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n"
        "f 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n");
    const auto mesh = read_obj(path);
    CHECK(mesh.triangles.size() == 2 * 4 + 6 * 2);
    CHECK(signed_volume(mesh) == Approx(6).epsilon(1e-15));
    const InsideTest inside(mesh);
    CHECK(inside({0.5, 1.5, 1}));
    CHECK(inside({1.5, 0.5, 1}));
    CHECK(!inside({1.5, 1.5, 1}));
}

TEST_CASE("Files that are no plain mesh are refused, with the line and what is wrong") {
    const std::string face = "f 1 2 3\n";
    holds(refusal(""), "has no vertex");
    holds(refusal("# nothing\n\n"), "has no vertex");
    holds(refusal(cube_vertices), "8 vertices and no face");
    holds(refusal("v 0 0 0\nv 1 nan 0\nv 0 1 0\n" + face), "Line 2 of ");
    holds(refusal("v 0 0 0\nv 1 nan 0\nv 0 1 0\n" + face), "coordinate \"nan\" for vertex 2");
    holds(refusal("v 0 0 0\r\nv 1 0 0\r\nv 0 -inf 0\r\n" + face), "Line 3 of ");
    holds(refusal("v 0 0 0\nv 1 1e999 0\nv 0 1 0\n" + face), "\"1e999\"");
    holds(refusal("v 0 0 0\nv 1 0x 0\nv 0 1 0\n" + face), "\"0x\"");
    holds(refusal("v 0 0\nv 1 0 0\nv 0 1 0\n" + face), "has 2 coordinates for vertex 1");
    holds(refusal(cube_vertices + "f 1 2\n"), "Line 9 of ");
    holds(refusal(cube_vertices + "f 1 2\n"), "a face of 2 vertices");
    holds(refusal(cube_vertices + "f\n"), "a face of 0 vertices");
    holds(refusal(cube_vertices + "f 1 2 9\n" + face), "Line 9 of ");
    holds(refusal(cube_vertices + "f 1 2 9\n" + face), "names vertex 9, but the file has 8");
    holds(refusal(cube_vertices + "f 1 2 0\n"), "index \"0\"");
    holds(refusal(cube_vertices + "f 1 2 x\n"), "index \"x\"");
    holds(refusal(cube_vertices + "f 1 2 99999999999999999999\n"), "index \"99999999999999999999\"");
    holds(refusal(cube_vertices + "f 1 2 -9\n"), "counts back by 9 vertices, of 8");
    holds(refusal(cube_vertices + "f 1 2 -9223372036854775808\n"), "counts back by 9223372036854775808 vertices, of 8");
    holds(refusal(cube_vertices + "f 1 2 9223372036854775807\n"),
          "names vertex 9223372036854775807, but the file has 8");
    holds(refusal(cube_vertices + "f 1 2 2\n"), "names vertex 2 twice");
    holds(refusal(cube_vertices + "f 1 2 -7\n"), "names vertex 2 twice");
    holds(refusal(cube_vertices + "f 1/-7 2 3\n"), "counts back by 7 texture coordinates, of 0");
    holds(refusal(cube_vertices + "vn 0 0 1\nf 1//-1 2//-2 3\n"), "Line 10 of ");
    holds(refusal(cube_vertices + "f 1/x 2 3\n"), "the corner \"1/x\"");
    holds(refusal(cube_vertices + "f 1/1/1/1 2 3\n"), "the corner \"1/1/1/1\"");
    holds(refusal(cube_vertices + "f 1 99999999999 88888888888\n"), "names vertex 99999999999, but the file has 8");
    holds(refusal("v 0 0 0 red\n" + face), "has \"red\" after the coordinates of vertex 1");

    const TemporaryFolder folder;
    CHECK_THROWS_AS(read_obj(folder.path() / "missing.obj"), io_error);
    CHECK_THROWS_AS(read_obj(folder.path()), io_error);
    CHECK_THROWS_AS(read_obj_points(folder.path() / "missing.obj"), io_error);
    if (std::filesystem::is_character_file("/dev/zero")) CHECK_THROWS_AS(read_obj("/dev/zero"), io_error);

    const auto cube = folder.path() / "cube.obj";
    std::ofstream(cube) << cube_vertices << face;
    memory_budget = 100;  // of 8 vertices the text alone is longer
    CHECK_THROWS_AS(read_obj(cube), memory_error);
    memory_budget = std::numeric_limits<double>::infinity();
    CHECK_NOTHROW(read_obj(cube));
}

TEST_CASE("Marks, blanks, comments after data and lines that go on are read as the format has them") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "given.obj";
    const auto read = [&](const std::string& text) {
        put(path, text);
        return read_obj(path);
    };
    const auto plain = read(cube_vertices + "f 1 2 3\nf 5 6 7 8\n");
    const auto same = [&](const std::string& text) {
        const auto mesh = read(text);
        return mesh.vertices == plain.vertices && mesh.triangles == plain.triangles;
    };
    CHECK(same("\xEF\xBB\xBF" + cube_vertices + "f 1 2 3\nf 5 6 7 8\n"));
    CHECK(same(cube_vertices + "f 1 2 3 # top\nf 5 6 7 8# bottom \\\n"));
    CHECK(same(cube_vertices + "f 1 \\\n2 3\nf 5 \\\r\n 6\\\n\t7 \\\n 8 \n"));
    CHECK(same(cube_vertices + "\ff 1 2\v3\n\f\nf\t5 6 7\f8\f\n"));
    CHECK(same(cube_vertices + "# path C:\\\nf 1 2 3\rf 5 6 7 8"));
    CHECK(same(cube_vertices + "fo 1 2 3\nf 5/ 6// 7/1/1 8/0\n"));
    // What the format has beside surfaces of polygons; a name may end with a backslash.
    CHECK(same("mtllib maps\\\n" + cube_vertices + "vp 1 2\nl 1 2\np 1\ns 1\nmg 1 0.1\nusemap off\nlod 1\n" +
               "cstype bezier\ndeg 3 3\nsurf 0 1 0 1 1 2 \\\n 3 4 5\nparm u 0 1\ntrim 0 1 1\nend\nf 1 2 3\n" +
               "shadow_obj a\ntrace_obj b\nctech cparm 1\nstech cspace 1\ncon 1 0 1 1 2 0 1 1\nf 5 6 7 8\n"));
    // Numbers of the file's lines, with all of these.
    holds(refusal("\xEF\xBB\xBF# one\nv 0 0 \\\n0\r\n\n\fv 0 x 0\n"), "Line 5 of ");
    holds(refusal("v 0 0 \\\nx\n"), "Line 1 of ");

    for (const char* word : {"V", "F", "fo2", "vv", "\xEF\xBB\xBFv", "call"}) {
        const auto said = refusal(cube_vertices + word + " 1 2 3\nf 1 2 3\n");
        holds(said, "Line 9 of ");
        holds(said, word[0] == '\xEF' ? "\\xef\\xbb\\xbfv" : word);
        holds(refusal("v 0 0 0\n" + std::string(word) + " 1 2 3\n", true), "Line 2 of ");
    }
    holds(refusal("v 0 0 0\nsurf 0 1 0 1 1\n"), "1 vertices and no face; its 1 free-form surfaces are not read");

    // "v 0" in UTF-16 with and without a mark, of either order, and in UTF-32.
    using namespace std::string_literals;
    for (const auto& text : {"\xFF\xFEv\0 \0"s, "\xFE\xFF\0v\0 "s, "v\0 \0"s, "\0v\0 "s, "\0\0\xFE\xFF\0\0\0v"s})
        for (const bool points : {false, true}) holds(refusal(text, points), "UTF-16");
}

TEST_CASE("Coordinates are read as what they say, each by one reader") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "points.obj";
    // The right numbers are those of the compiler.
    put(path,
        "v +1 -.5 5.\nv 1.7976931348623157e308 -1.7976931348623157E+308 4.9406564584124654e-324\n"
        "v 0.1 0.30000000000000004 123456789012345678901234567890\nv 1e-400 -0.00001e-340 0e999\n"
        "v 1e-99999999999999999999 2.2250738585072011e-308 9007199254740993 1.0 0.5\n"
        "v 1000000e-330 0.0000000000000000000000000001e330 7.2057594037927933e16\n");
    const std::vector<Vec<double, 3>> right{{1, -.5, 5.},
                                            {1.7976931348623157e308, -1.7976931348623157E+308, 4.9406564584124654e-324},
                                            {0.1, 0.30000000000000004, 123456789012345678901234567890.0},
                                            {0, 0, 0},
                                            {0, 2.2250738585072011e-308, 9007199254740993.0},
                                            {0, 1e302, 7.2057594037927933e16}};
    CHECK(read_obj_points(path) == right);
    for (const char* word : {"+-1", "-+1", "++1", "+", "-", ".", "e5", "1e", "0x10", "1,5", "1.0f", "1d5", "nan", "inf",
                             "1.7976931348623159e308", "-1e309", "1e99999999999999999999", "1_000",
                             "\xC2\xA0"
                             "1"})
        holds(refusal("v 0 0 0\nv 0 " + std::string(word) + " 0\n", true), "Line 2 of ");
    holds(refusal(cube_vertices + "f 1 2 +-3\n"), "index \"+-3\"");
    CHECK(refusal(cube_vertices + "f 1 2 +3\n") == "read");
}

TEST_CASE(
    "A polygon that cannot be cut is refused with its line, what is wrong, and vertices as the file counts them") {
    // A dart in front of 10 other vertices; the area of what is cut is that of the polygon.
    const std::string dart = "v 0 2 0\nv -0.2 0 0\nv 0 1.5 0\nv 0.2 0 0\n";
    const TemporaryFolder folder;
    put(folder.path() / "dart.obj", dart + "f 1 2 3 4\n");
    double area = 0;
    const auto mesh = read_obj(folder.path() / "dart.obj");
    for (const auto& [i, j, k] : mesh.triangles)
        area += cross(mesh.vertices[std::size_t(j)] - mesh.vertices[std::size_t(i)],
                      mesh.vertices[std::size_t(k)] - mesh.vertices[std::size_t(i)])[2] /
                2;
    CHECK(area == Approx(0.1).epsilon(1e-14));

    const auto crossed = refusal("v 9 9 9\n" + dart + "v 0.3 1 0\n\nf 3 2 5 4 6\n");
    holds(crossed, "Line 8 of ");
    holds(crossed, "a face of 5 corners that crosses or touches itself");
    holds(crossed, "edges from vertex ");
    const auto bow = refusal("v 0 0 0\nv 1 1 0\nv 2 0 0\nv 0 0.5 0\nf 1 2 3 4\n");
    holds(bow, "its edges from vertex 1 to vertex 2 and from vertex 3 to vertex 4 meet");
    const auto last = refusal("v 0 0 0\nv 1 1 0\nv 2 0 0\nv 0 0.5 0\nf 4 1 2 3\n");
    holds(last, "from vertex 1 to vertex 2 and from vertex 3 to vertex 4");
    holds(refusal("v 0 0 0\nv 1 1 1\nv 2 2 2\nv 3 3 3\nf 1 2 3 4\n"), "has a face of 4 corners that has no area");
}

TEST_CASE("Bare points: written and read again to the last digits, in double and float, 2D and 3D") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "points_0001.obj";
    const std::vector<Vec<double, 3>> points{{0.1, -2.0 / 3, 1e-7}, {12345.678901234567, 0, -1e20}, {1, 2, 3}};
    write_obj_points(path, points);
    const auto read = read_obj_points(path);
    REQUIRE(read.size() == points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (int k = 0; k < 3; ++k) CHECK(read[i][k] == points[i][k]);
    }

    const std::vector<Vec<float, 2>> flat{{0.1f, -0.3f}};
    write_obj_points(path, flat);
    CHECK(detail::read_text(path) == "# particles, positions in metres\nv 0.1 -0.3 0\n");

    write_obj_points(path, std::vector<Vec<float, 3>>{});
    holds(refusal("# particles, positions in metres\n", true), "has no point");
    holds(refusal(cube_vertices + "f 1 2 3\n", true), "has 1 faces; bare points are expected");
    holds(refusal("v 1 2\n", true), "has 2 coordinates");
    CHECK(refusal(cube_vertices + "p 1 2 3\n", true) == "read");
}

TEST_CASE("Surfaces: a mesh, a cloth and a state are written with their faces, points counted from 1") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "surface_0001.obj";
    std::ofstream(path) << cube_vertices + "f 1 2 3 4\nf 1 4 8 5\nf 2 6 7 3\n";
    const TriangleMesh mesh = read_obj(path);
    write_obj(path, mesh);
    const TriangleMesh again = read_obj(path);
    CHECK(again.triangles == mesh.triangles);
    CHECK(again.vertices == mesh.vertices);

    ParticleSystem<3> system;
    system.add(cloth({0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}, {2, 1}), {});
    write_obj(path, system.points.position, system.facets);
    const TriangleMesh of_cloth = read_obj(path);
    REQUIRE(of_cloth.vertices.size() == 6);
    REQUIRE(of_cloth.triangles.size() == 4);
    for (std::size_t f = 0; f < 4; ++f)
        for (std::size_t k = 0; k < 3; ++k) CHECK(std::cmp_equal(of_cloth.triangles[f][k], system.facets[f][k]));

    const std::vector<Vec<float, 2>> flat{{0.0F, 0.0F}, {0.5F, 0.0F}, {0.5F, -1.0F}};
    write_obj(path, flat, std::vector<std::array<int, 2>>{{0, 1}, {1, 2}});
    const std::string text = "v 0 0 0\nv 0.5 0 0\nv 0.5 -1 0\nl 1 2\nl 2 3\n";
    CHECK(detail::read_text(path) == "# a surface, positions in metres\n" + text);
    State<float> state;
    state.dimension = 2;
    state.fields = {{"position", "m", 2, {0, 0, 0.5F, 0, 0.5F, -1}}};
    state.id = {3, 4, 7};
    state.body = {0, 0, 0};
    state.facets = {0, 1, 1, 2};
    write_obj(path, state);
    CHECK(detail::read_text(path) == "# a surface, positions in metres\n" + text);
    state.facets.clear();
    write_obj(path, state);
    CHECK(detail::read_text(path) == "# particles, positions in metres\nv 0 0 0\nv 0.5 0 0\nv 0.5 -1 0\n");

    put(path, "before");
    for (const int corner : {-1, 3})
        CHECK_THROWS_AS(write_obj(path, flat, std::vector<std::array<int, 2>>{{0, corner}}), parameter_error);
    CHECK(detail::read_text(path) == "before");
}

TEST_CASE("A point that is not finite is refused and leaves the file before as it was, and no temporary one") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "points.obj";
    put(path, "before");
    std::vector<Vec<double, 3>> points(20000, {1, 2, 3});
    points[15000][1] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(write_obj_points(path, points), parameter_error);
    CHECK(detail::read_text(path) == "before");
    CHECK(folder.count() == 1);
    points[15000][1] = 2;
    CHECK_THROWS_AS(write_obj_points(folder.path() / "no_such_folder" / "a.obj", points), io_error);
}

}  // namespace obj_tests
