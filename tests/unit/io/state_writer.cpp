#include "support/catch.hpp"
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>

#include "example_state.hpp"
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

using states::example;
using states::Folder;

namespace state_writer_tests {
namespace {

/// A disk that is full after `bytes` of a file: writes beyond fail (EFBIG).
class FullDisk {
public:
    explicit FullDisk(std::uintmax_t bytes) {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        handler_ = std::signal(SIGXFSZ, SIG_IGN);
        const rlimit now{rlim_t(bytes), before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &now);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;
    ~FullDisk() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }

private:
    rlimit before_{};
    void (*handler_)(int) = nullptr;
};

ssize_t open_hdf5_objects() { return H5Fget_obj_count(hid_t(H5F_OBJ_ALL), H5F_OBJ_ALL); }

}  // namespace

TEMPLATE_TEST_CASE("A state read back has the bits that were written", "[io][state]", float, double) {
    const Folder folder;
    // 0 and 1: the smallest; 1000: all in HDF5's memory; 70,000: scalars, too, are placed by us (256 KiB and more).
    for (const int dimension : {2, 3}) {
        for (const std::size_t count : {0, 1, 1000, 70'000}) {
            for (const int compression : {0, 3}) {
                CAPTURE(dimension, count, compression);
                const auto state = example<TestType>(dimension, count);
                firn::write_state(folder / "a.hdf", state, {compression});
                CHECK(states::same_bits(firn::read_state<TestType>(folder / "a.hdf"), state));
            }
        }
    }
    CHECK(folder.names() == std::set<std::string>{"a.hdf"});
}

TEST_CASE("Many fields, parameters and attributes keep their order", "[io][state]") {
    const Folder folder;
    // More than eight, where HDF5 changes how it stores a group's members, and names against the alphabet.
    auto state = example<float>(3, 40'000);
    for (int i = 40; i > 0; --i) {
        const auto name = "x" + std::to_string(i);
        state.fields.push_back({name, "1", 1, states::any_bits<float>(state.size(), std::uint64_t(i))});
        state.parameters.push_back({"walls", name, "1", {double(i)}});
        state.attributes.push_back({name, std::string(std::size_t(i) * 100, 'x')});
    }
    firn::write_state(folder / "a.hdf", state);
    CHECK(states::same_bits(firn::read_state<float>(folder / "a.hdf"), state));
}

TEST_CASE("More parameters than datasets, and texts longer than attributes, are read back", "[io][state]") {
    // Groups by turns, as no file of datasets keeps them; values of several lengths; units with and without letters.
    const Folder folder;
    auto state = example<float>(3, 10);
    const auto with_parameters = [&](std::size_t count) {
        auto more = state;
        for (std::size_t i = more.parameters.size(); i < count; ++i)
            more.parameters.push_back({i % 2 ? "odd" : "even", std::to_string(i) + "_radius", i % 5 ? "m/s²" : "",
                                       std::vector<double>(1 + i % 7, 1.0 / double(i + 1))});
        return more;
    };
    const auto has = [&](const char* path) {
        const firn::hdf5::File file(H5Fopen((folder / "a.hdf").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), "open");
        return H5Lexists(file.id(), path, H5P_DEFAULT) > 0;
    };
    state.attributes.insert(state.attributes.begin(), {"first", std::string(firn::detail::max_state_text, 'a')});
    state.attributes.insert(state.attributes.begin() + 1,
                            {"second", std::string(firn::detail::max_state_text + 1, 'b')});
    state.attributes.push_back({"last", std::string(1'000'000, 'c')});
    for (const int compression : {0, 3}) {
        for (const std::size_t count : {std::size_t(513), std::size_t(20'000)}) {
            CAPTURE(compression, count);
            const auto many = with_parameters(count);
            firn::write_state(folder / "a.hdf", many, {.compression = compression});
            CHECK(states::same_bits(firn::read_state<float>(folder / "a.hdf"), many));
            CHECK(has("/firn/parameter_list/values"));
            CHECK_FALSE(has("/firn/parameters/grid"));
        }
    }
    CHECK_FALSE(has("/firn/texts/first"));
    CHECK(has("/firn/texts/second"));

    // One fewer has its datasets, and so have older files of any number, which are read as before.
    state.attributes.erase(state.attributes.begin(), state.attributes.begin() + 2);
    state.attributes.pop_back();
    auto few = with_parameters(512);
    firn::write_state(folder / "a.hdf", few);
    CHECK(has("/firn/parameters/even/510_radius"));
    CHECK_FALSE(has("/firn/parameter_list"));
    CHECK_FALSE(has("/firn/texts"));
    const auto grouped = firn::read_state<float>(folder / "a.hdf");
    {
        const firn::hdf5::File file(H5Fopen((folder / "a.hdf").c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
        for (int i = 0; i < 1000; ++i)
            H5Lcreate_hard(file.id(), "/firn/parameters/odd/511_radius", file.id(),
                           ("/firn/parameters/odd/older_" + std::to_string(i)).c_str(), H5P_DEFAULT, H5P_DEFAULT);
    }
    const auto older = firn::read_state<float>(folder / "a.hdf", {.verify = false});
    REQUIRE(older.parameters.size() == 1512);
    CHECK(older.parameters.back().values == grouped.parameters.back().values);
}

/// A state of as many parts as a file takes: the limits of writer and reader are the same.
firn::State<float> of_most_parts() {
    auto state = example<float>(2, 0);
    const auto name = [](const auto& parts) { return "part " + std::to_string(parts.size()); };
    while (state.attributes.size() < 4093) state.attributes.push_back({name(state.attributes), "x"});
    while (state.fields.size() < 4095) state.fields.push_back({name(state.fields), "", 1, {}});
    while (state.tables.size() < 4096) state.tables.push_back({name(state.tables), 1, {}});
    return state;
}

TEST_CASE("A state of more parts than the reader takes is refused before it is written", "[io][state]") {
    const Folder folder;
    const auto refused = [&](const auto& add) {
        auto more = of_most_parts();
        firn::check_state(more);
        add(more);
        return states::message<firn::parameter_error>([&] { firn::write_state(folder / "a.hdf", more); });
    };
    CHECK(states::holds(refused([](auto& s) { s.attributes.push_back({"more", "x"}); }),
                        "4094 attributes; give at most 4093"));
    CHECK(states::holds(refused([](auto& s) { s.fields.push_back({"more", "", 1, {}}); }),
                        "4096 fields; give at most 4095"));
    CHECK(
        states::holds(refused([](auto& s) { s.tables.push_back({"more", 1, {}}); }), "4097 tables; give at most 4096"));
    CHECK(folder.names().empty());
}

TEST_CASE("A state of as many parts as the reader takes is written and read", "[io][state][.full]") {
    const Folder folder;
    firn::write_state(folder / "a.hdf", of_most_parts());
    CHECK(states::same_bits(firn::read_state<float>(folder / "a.hdf"), of_most_parts()));
}

TEST_CASE("The same state gives the same bytes", "[io][state]") {
    const Folder folder;
    const auto small = example<float>(2, 3), large = example<float>(2, 70'000);
    firn::write_state(folder / "small.hdf", small);
    firn::write_state(folder / "large.hdf", large, {1});
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // HDF5's time stamps count seconds
    firn::write_state(folder / "small again.hdf", small);
    firn::write_state(folder / "large again.hdf", large, {1});
    const auto same = [&](const char* a, const char* b) {
        return states::bytes_of(folder / a) == states::bytes_of(folder / b);
    };
    CHECK(same("small.hdf", "small again.hdf"));
    CHECK(same("large.hdf", "large again.hdf"));
}

TEST_CASE("A state lies in the file as VTKHDF 1.0 wants it", "[io][state]") {
    // Layout: VTK file formats, "VTKHDF", UnstructuredGrid. Read with HDF5 alone, by path.
    const Folder folder;
    auto state = example<float>(2, 2);
    state.fields[0].values = {1, 2, 3, 4};
    firn::write_state(folder / "a.hdf", state);
    const firn::hdf5::File file(H5Fopen((folder / "a.hdf").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), "open");

    const auto numbers = [&](const char* path) {
        const firn::hdf5::Dataset dataset(H5Dopen2(file.id(), path, H5P_DEFAULT), path);
        const firn::hdf5::Dataspace space(H5Dget_space(dataset.id()), path);
        std::vector<double> values(std::size_t(H5Sget_simple_extent_npoints(space.id())));
        H5Dread(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        return values;
    };
    using Numbers = std::vector<double>;
    CHECK(numbers("/VTKHDF/NumberOfPoints") == Numbers{2});
    CHECK(numbers("/VTKHDF/NumberOfCells") == Numbers{2});
    CHECK(numbers("/VTKHDF/NumberOfConnectivityIds") == Numbers{2});
    CHECK(numbers("/VTKHDF/Connectivity") == Numbers{0, 1});
    CHECK(numbers("/VTKHDF/Offsets") == Numbers{0, 1, 2});
    CHECK(numbers("/VTKHDF/Types") == Numbers{1, 1});
    CHECK(numbers("/VTKHDF/Points") == Numbers{1, 2, 0, 3, 4, 0});
    CHECK(numbers("/VTKHDF/FieldData/TimeValue") == Numbers{0.1});
    CHECK(numbers("/VTKHDF/PointData/id") == Numbers{1e10, 5e9});
    CHECK(numbers("/firn/parameters/grid/cell_size") == Numbers{1.0 / 128});

    const firn::hdf5::Group vtk(H5Gopen2(file.id(), "/VTKHDF", H5P_DEFAULT), "open");
    const firn::hdf5::Attribute type(H5Aopen(vtk.id(), "Type", H5P_DEFAULT), "open");
    const firn::hdf5::Datatype text(H5Aget_type(type.id()), "type");
    CHECK(H5Tis_variable_str(text.id()) == 0);
    CHECK(H5Tget_cset(text.id()) == H5T_CSET_ASCII);
    CHECK(firn::detail::read_text(vtk.id(), "Type") == "UnstructuredGrid");
    const firn::hdf5::Attribute version(H5Aopen(vtk.id(), "Version", H5P_DEFAULT), "open");
    std::int64_t read[2] = {-1, -1};
    H5Aread(version.id(), H5T_NATIVE_INT64, read);
    CHECK(read[0] == 1);
    CHECK(read[1] == 0);
}

TEST_CASE("Only the fields asked for are written, with positions, ids and all words", "[io][state]") {
    const Folder folder;
    auto state = example<float>(3, 20);
    const std::string kept = state.fields[2].name;
    firn::write_state(folder / "few.hdf", state, {.fields = {kept}});
    const auto found = firn::read_state<float>(folder / "few.hdf");
    REQUIRE(found.fields.size() == 2);
    CHECK(found.find("position") != nullptr);
    const auto &written = state.field(kept).values, &read = found.field(kept).values;
    REQUIRE(read.size() == written.size());
    CHECK(std::memcmp(read.data(), written.data(), read.size() * sizeof(float)) == 0);
    CHECK(found.id == state.id);
    CHECK(found.parameters == state.parameters);
    CHECK_THROWS_AS(firn::write_state(folder / "none.hdf", state, {.fields = {"temperature"}}), firn::parameter_error);
    CHECK(folder.names().size() == 1);
}

TEST_CASE("Compression makes smooth data smaller", "[io][state]") {
    const Folder folder;
    auto state = example<float>(3, 20'000);
    for (auto& field : state.fields) std::fill(field.values.begin(), field.values.end(), 1.0f);
    firn::write_state(folder / "plain.hdf", state);
    firn::write_state(folder / "small.hdf", state, {1});
    CHECK(std::filesystem::file_size(folder / "small.hdf") * 5 < std::filesystem::file_size(folder / "plain.hdf"));
    CHECK_THROWS_AS(firn::write_state(folder / "no.hdf", state, {10}), firn::parameter_error);
    CHECK_THROWS_AS(firn::write_state(folder / "no.hdf", state, {-1}), firn::parameter_error);
    CHECK(folder.names() == std::set<std::string>{"plain.hdf", "small.hdf"});
}

TEST_CASE("A disk that is full at any byte gives an io_error and no file, and earlier states stay whole",
          "[io][state]") {
    const Folder folder;
    const auto before = example<double>(3, 4);
    // 200 particles go through HDF5's memory; 33,000 are placed.
    for (const std::size_t count : {200, 33'000}) {
        const auto state = example<float>(3, count);
        firn::write_state(folder / "old.hdf", before);
        firn::write_state(folder / "whole.hdf", state);
        const auto size = std::filesystem::file_size(folder / "whole.hdf");
        std::filesystem::remove(folder / "whole.hdf");
        for (int part = 0; part < 60; ++part) {
            const auto room = part == 59 ? size - 1 : size * std::uintmax_t(part) / 60;
            CAPTURE(count, size, room);
            std::string message;
            {
                const FullDisk disk(room);
                message = states::message<firn::io_error>([&] { firn::write_state(folder / "new.hdf", state); });
                CHECK_THROWS_AS(firn::write_state(folder / "old.hdf", state), firn::io_error);
            }
            CHECK(states::holds(message, "new.hdf"));
            CHECK(states::holds(message, "File too large"));
            CHECK(folder.names() == std::set<std::string>{"old.hdf"});
        }
        CHECK(states::same_bits(firn::read_state<double>(folder / "old.hdf"), before));
        CHECK(open_hdf5_objects() == 0);
        {
            const FullDisk disk(size);
            CHECK_NOTHROW(firn::write_state(folder / "new.hdf", state));
        }
        CHECK(states::same_bits(firn::read_state<float>(folder / "new.hdf"), state));
        std::filesystem::remove(folder / "new.hdf");
    }
}

TEST_CASE("A path that cannot be written gives an io_error that names it", "[io][state]") {
    const Folder folder;
    const auto state = example<float>(3, 1);
    CHECK(states::holds(states::message<firn::io_error>([&] { firn::write_state(folder / "no/a.hdf", state); }),
                        "no/a.hdf"));
    states::put_bytes(folder / "file", "");
    CHECK_THROWS_AS(firn::write_state(folder / "file/a.hdf", state), firn::io_error);
    std::filesystem::create_directory(folder / "taken.hdf");
    CHECK_THROWS_AS(firn::write_state(folder / "taken.hdf", state), firn::io_error);
    CHECK(folder.names() == std::set<std::string>{"file", "taken.hdf"});
}

}  // namespace state_writer_tests
