/// \file Facets in a state's file: as VTKHDF wants them, back with the same numbers, and refused when broken.
#include "support/catch.hpp"
#include <firn/io/particle_system_state.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>
#include <firn/lagrangian/cloth.hpp>
#include <firn/lagrangian/rope.hpp>

#include "example_state.hpp"

#include <functional>

using states::example;
using states::Folder;

namespace {

using Numbers = std::vector<std::int64_t>;

Numbers numbers(const std::filesystem::path& path, const char* dataset_path) {
    const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), "open");
    const firn::hdf5::Dataset dataset(H5Dopen2(file.id(), dataset_path, H5P_DEFAULT), dataset_path);
    const firn::hdf5::Dataspace space(H5Dget_space(dataset.id()), dataset_path);
    Numbers values(std::size_t(H5Sget_simple_extent_npoints(space.id())));
    H5Dread(dataset.id(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    return values;
}

/// Writes other numbers over a dataset's first.
void overwrite(hid_t file, const char* path, std::size_t at, std::int64_t value) {
    const firn::hdf5::Dataset dataset(H5Dopen2(file, path, H5P_DEFAULT), path);
    const firn::hdf5::Dataspace space(H5Dget_space(dataset.id()), path);
    Numbers values(std::size_t(H5Sget_simple_extent_npoints(space.id())));
    H5Dread(dataset.id(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    values.at(at) = value;
    H5Dwrite(dataset.id(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
}

/// Five points, two triangles over four of them; in the plane a chain of two edges over three.
template <class S>
firn::State<S> small(int dimension) {
    auto state = example<S>(dimension, 5);
    state.facets = dimension == 3 ? Numbers{0, 1, 3, 1, 4, 3} : Numbers{3, 0, 0, 2};
    return state;
}

}  // namespace

TEMPLATE_TEST_CASE("Facets read back are those that were written, small and large, in 2D and 3D", "[io][state]", float,
                   double) {
    const Folder folder;
    for (const int dimension : {2, 3}) {
        for (const int compression : {0, 3}) {
            CAPTURE(dimension, compression);
            const auto state = small<TestType>(dimension);
            firn::write_state(folder / "a.hdf", state, {compression});
            CHECK(states::same_bits(firn::read_state<TestType>(folder / "a.hdf"), state));
            // 70,000 points: the cells' arrays are placed in the file by us.
            auto large = example<TestType>(dimension, 70'000);
            for (std::int64_t i = 0; i < 60'000 * dimension; ++i) large.facets.push_back(i * 7919 % 70'000);
            firn::write_state(folder / "a.hdf", large, {compression});
            CHECK(states::same_bits(firn::read_state<TestType>(folder / "a.hdf"), large));
        }
    }
}

TEST_CASE("Facets lie in the file as cells of VTKHDF, and every point that none uses as a vertex", "[io][state]") {
    // VTK's numbers of cells: 1 vertex, 3 line, 5 triangle (vtkCellType.h).
    const Folder folder;
    const auto path = folder / "a.hdf";
    firn::write_state(path, small<float>(3));
    CHECK(numbers(path, "/VTKHDF/NumberOfPoints") == Numbers{5});
    CHECK(numbers(path, "/VTKHDF/NumberOfCells") == Numbers{3});
    CHECK(numbers(path, "/VTKHDF/NumberOfConnectivityIds") == Numbers{7});
    CHECK(numbers(path, "/VTKHDF/Connectivity") == Numbers{0, 1, 3, 1, 4, 3, 2});
    CHECK(numbers(path, "/VTKHDF/Offsets") == Numbers{0, 3, 6, 7});
    CHECK(numbers(path, "/VTKHDF/Types") == Numbers{5, 5, 1});
    firn::write_state(path, small<float>(2));
    CHECK(numbers(path, "/VTKHDF/NumberOfCells") == Numbers{4});
    CHECK(numbers(path, "/VTKHDF/Connectivity") == Numbers{3, 0, 0, 2, 1, 4});
    CHECK(numbers(path, "/VTKHDF/Offsets") == Numbers{0, 2, 4, 5, 6});
    CHECK(numbers(path, "/VTKHDF/Types") == Numbers{3, 3, 1, 1});
}

TEST_CASE("A state whose facets name points that are not there, or are cut, is not written", "[io][state]") {
    const Folder folder;
    for (const std::int64_t wrong : {-1, 5}) {
        auto state = small<float>(3);
        state.facets[4] = wrong;
        CHECK(states::holds(states::message<firn::parameter_error>([&] { firn::write_state(folder / "a.hdf", state); }),
                            "names point " + std::to_string(wrong) + ", but there are 5"));
    }
    auto state = small<float>(3);
    state.facets.pop_back();
    CHECK(states::holds(states::message<firn::parameter_error>([&] { firn::write_state(folder / "a.hdf", state); }),
                        "are 5 point numbers; give 3 for each"));
    CHECK(folder.names().empty());
}

TEST_CASE("A file whose cells are broken is refused with the reason", "[io][state]") {
    struct Forgery {
        std::string reason;
        std::function<void(hid_t)> make;
    };
    constexpr std::int64_t least = std::numeric_limits<std::int64_t>::min(), most = -(least + 1);
    const auto put = [](const char* name, std::size_t at, std::int64_t value) {
        return [=](hid_t file) { overwrite(file, (std::string("/VTKHDF/") + name).c_str(), at, value); };
    };
    const std::vector<Forgery> forgeries = {
        {"names point 5", put("Connectivity", 1, 5)},
        {"names point -1", put("Connectivity", 6, -1)},
        {"names point " + std::to_string(most), put("Connectivity", 0, most)},
        {"cell 0 has the points from 0 to 4", put("Offsets", 1, 4)},
        {"cell 1 has the points from 3 to 2", put("Offsets", 2, 2)},
        {"cell 1 has the points from 3 to " + std::to_string(most), put("Offsets", 2, most)},
        {"cell 0 has the points from 0 to " + std::to_string(least), put("Offsets", 1, least)},
        {"Offsets run from 1", put("Offsets", 0, 1)},
        {"Offsets run from 0 to 8", put("Offsets", 3, 8)},
        {"cell 1 is of VTK's type 9", put("Types", 1, 9)},
        {"cell 0 is of VTK's type 3", put("Types", 0, 3)},  // a line in 3D
        {"cell 0 has the points from 0 to 3 of Connectivity, where 1", put("Types", 0, 1)},
        {"'Types' has 3 rows where 4", put("NumberOfCells", 0, 4)},
        {"'Types' has 3 rows where 2", put("NumberOfCells", 0, 2)},
        {"a cell has one point or more", put("NumberOfCells", 0, -1)},
        {"a cell has one point or more", put("NumberOfCells", 0, most)},
        {"'Connectivity' has 7 rows where", put("NumberOfConnectivityIds", 0, most)},
        {"a cell has one point or more", put("NumberOfConnectivityIds", 0, least)},
        {"no 'Types'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/Types", H5P_DEFAULT); }},
        {"no 'Offsets'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/Offsets", H5P_DEFAULT); }},
        {"no 'Connectivity'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/Connectivity", H5P_DEFAULT); }},
        {"no 'NumberOfCells'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/NumberOfCells", H5P_DEFAULT); }},
    };
    const Folder folder;
    const auto path = folder / "forged.hdf";
    for (const auto& forgery : forgeries) {
        firn::write_state(path, small<float>(3));
        {
            const firn::hdf5::Quiet quiet;
            const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
            forgery.make(file.id());
        }
        const auto message = states::message<firn::io_error>([&] { return firn::read_state<float>(path); });
        INFO(message);
        CHECK(states::holds(message, forgery.reason));
        CHECK(states::holds(message, "forged.hdf"));
    }
}

TEMPLATE_TEST_CASE("Point masses become a state with their surface, and come back from the file", "[io][state]", float,
                   double) {
    using firn::Vec;
    const auto net = firn::cloth({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {2, 2});
    firn::PointMasses<TestType, 3> points;
    const auto add = [&](const Vec<double, 3>& x, std::uint32_t group) {
        points.add({.position = x, .velocity = {1, 2, 3}, .mass = 0.5, .radius = 0.25, .group = group});
    };
    add({5, 5, 5}, 0);
    for (const auto& x : net.positions) add(x, 3);
    points.pin(1);
    points.remove_if([](std::size_t i) { return i == 0; });
    const auto state = firn::state_of(points, net.facets, 1.5, 20);
    CHECK(state.time == 1.5);
    CHECK(state.step == 20);
    CHECK(state.id == Numbers{1, 2, 3, 4, 5, 6, 7, 8, 9});
    CHECK(state.body == std::vector<std::int32_t>(9, 3));
    CHECK(state.facets.size() == 24);
    CHECK(state.field("pinned").values == std::vector<TestType>{1, 0, 0, 0, 0, 0, 0, 0, 0});
    CHECK(state.field("position").values[3] == TestType(0.5));
    CHECK(state.field("velocity").values[5] == TestType(3));
    CHECK(state.field("mass").values[8] == TestType(0.5));
    CHECK(state.field("radius").values[8] == TestType(0.25));
    const Folder folder;
    firn::write_state(folder / "a.hdf", state);
    CHECK(firn::read_state<TestType>(folder / "a.hdf") == state);

    points.remove_if([](std::size_t i) { return i == 8; });
    CHECK_THROWS_AS(firn::state_of(points, net.facets, 1.5, 20), firn::parameter_error);

    const auto line = firn::rope<2>({0, 0}, {1, 0}, 3);
    firn::PointMasses<TestType, 2> flat;
    for (const auto& x : line.positions) flat.add({.position = x});
    const auto flat_state = firn::state_of(flat, line.facets, 0, 0);
    CHECK(flat_state.facets == Numbers{0, 1, 1, 2, 2, 3});
    firn::write_state(folder / "b.hdf", flat_state);
    CHECK(firn::read_state<TestType>(folder / "b.hdf") == flat_state);
}

TEMPLATE_TEST_CASE("A particle system becomes a state: its points, its facets by place, when, and its gravity",
                   "[io][state]", float, double) {
    firn::ParticleSystem<2, TestType> system;
    system.points.add({.position = {5, 5}, .end = 0.015});
    const auto line = firn::rope<2>({0, 0}, {1, 0}, 3);
    const std::size_t first = system.add(line, {.mass = 0.5, .radius = 0.25, .group = 7});
    system.points.pin(std::uint32_t(first));
    system.damping = 0.5;
    for (int step = 0; step < 2; ++step) system.step(0.01);  // the loose point has died
    const auto state = firn::state_of(system);
    CHECK(state.dimension == 2);
    CHECK(state.step == 2);
    CHECK(state.time == Approx(0.02));
    CHECK(state.id == Numbers{1, 2, 3, 4});
    CHECK(state.body == std::vector<std::int32_t>(4, 7));
    CHECK(state.facets == Numbers{0, 1, 1, 2, 2, 3});
    CHECK(state.field("pinned").values == std::vector<TestType>{1, 0, 0, 0});
    using Parameter = firn::StateParameter;
    REQUIRE(state.parameters.size() == 7);
    CHECK(state.parameters[0] == Parameter{"system", "gravity", "m/s^2", {0, -9.81}});
    CHECK(state.parameters[1] == Parameter{"system", "damping", "1/s", {0.5}});
    CHECK(state.parameters[2] == Parameter{"system", "iterations", "1", {8}});
    CHECK(state.parameters[3] == Parameter{"system", "restitution", "1", {0}});
    CHECK(state.parameters[4] == Parameter{"system", "next_id", "1", {5}});
    CHECK(state.field("inverse_mass").values == std::vector<TestType>{0, 2, 2, 2});
    CHECK(state.field("since").values == std::vector<TestType>(4, TestType(0.01) / 2));  // Verlet: half a step
    const Folder folder;
    firn::write_state(folder / "a.hdf", state);
    CHECK(firn::read_state<TestType>(folder / "a.hdf") == state);
}
