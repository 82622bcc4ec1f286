#include "support/catch.hpp"
#include <firn/io/state_reader.hpp>
#include <firn/io/state_writer.hpp>

#include "example_state.hpp"

#include <functional>
#include <limits>

using states::example;
using states::Folder;

namespace state_reader_tests {
namespace {

std::string refusal(const std::filesystem::path& path) {
    return states::message<firn::io_error>([&] { return firn::read_state<float>(path); });
}

/// Puts a dataset of float zeros in the place of another, as `layout` says.
void replace(hid_t file, const char* path, std::vector<hsize_t> extent, hid_t layout = H5P_DEFAULT,
             hid_t type = H5T_IEEE_F32LE, bool fill = true) {
    H5Ldelete(file, path, H5P_DEFAULT);
    const firn::hdf5::Dataspace space(H5Screate_simple(int(extent.size()), extent.data(), nullptr), "space");
    const firn::hdf5::Dataset dataset(H5Dcreate2(file, path, type, space.id(), H5P_DEFAULT, layout, H5P_DEFAULT), path);
    if (!fill) return;
    const std::vector<double> zeros(std::size_t(H5Sget_simple_extent_npoints(space.id())));
    firn::hdf5::check(H5Dwrite(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros.data()), path);
}

void set_integer(hid_t file, const char* group, const char* name, std::int64_t value) {
    const firn::hdf5::Group owner(H5Gopen2(file, group, H5P_DEFAULT), group);
    const firn::hdf5::Attribute attribute(H5Aopen(owner.id(), name, H5P_DEFAULT), name);
    H5Awrite(attribute.id(), H5T_NATIVE_INT64, &value);
}

}  // namespace

TEST_CASE("A state of the other precision is refused with the advice how to read it", "[io][state]") {
    const Folder folder;
    firn::write_state(folder / "f.hdf", example<float>(3, 2));
    firn::write_state(folder / "d.hdf", example<double>(3, 2));
    CHECK(states::holds(refusal(folder / "d.hdf"),
                        "64-bit float where 32-bit float is expected; read it with "
                        "read_state<double>"));
    CHECK(states::holds(states::message<firn::io_error>([&] { return firn::read_state<double>(folder / "f.hdf"); }),
                        "read_state<float>"));
}

TEST_CASE("What is not a state is refused with the file's name", "[io][state]") {
    const Folder folder;
    CHECK(states::holds(refusal(folder / "none.hdf"), "No such file"));
    CHECK(states::holds(refusal(folder.path()), folder.path().string()));
    states::put_bytes(folder / "text.hdf", "not HDF5");
    CHECK(states::holds(refusal(folder / "text.hdf"), "text.hdf"));
    states::put_bytes(folder / "empty.hdf", "");
    CHECK(states::holds(refusal(folder / "empty.hdf"), "empty.hdf"));
    // A foreign HDF5 file.
    firn::hdf5::File(H5Fcreate((folder / "foreign.hdf").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), "create");
    CHECK(states::holds(refusal(folder / "foreign.hdf"), "has no 'firn'"));
}

TEST_CASE("A state cut at any length is refused", "[io][state]") {
    const Folder folder;
    for (const int compression : {0, 1}) {
        firn::write_state(folder / "a.hdf", example<float>(3, 500), {compression});
        const auto whole = states::bytes_of(folder / "a.hdf");
        for (std::size_t part = 0; part < 100; ++part) {
            const std::size_t length = part == 99 ? whole.size() - 1 : whole.size() * part / 100;
            CAPTURE(compression, length);
            states::put_bytes(folder / "cut.hdf", whole.substr(0, length));
            CHECK(states::holds(refusal(folder / "cut.hdf"), "cut.hdf"));
        }
    }
}

TEST_CASE("A well-formed HDF5 file that is no state, or claims what it does not hold, is refused with the reason",
          "[io][state]") {
    struct Forgery {
        std::string reason;
        std::function<void(hid_t)> make;
    };
    constexpr hsize_t many = hsize_t(1) << 40;
    const firn::hdf5::Properties chunked(H5Pcreate(H5P_DATASET_CREATE), "layout"),
        unknown_filter(H5Pcreate(H5P_DATASET_CREATE), "layout"), outside(H5Pcreate(H5P_DATASET_CREATE), "layout");
    const hsize_t chunk = 4;
    H5Pset_chunk(chunked.id(), 1, &chunk);
    H5Pset_chunk(unknown_filter.id(), 1, &chunk);
    H5Pset_scaleoffset(unknown_filter.id(), H5Z_SO_FLOAT_DSCALE, 2);
    H5Pset_external(outside.id(), "/etc/hostname", 0, 16);

    const std::vector<Forgery> forgeries = {
        {"no 'VTKHDF'", [](hid_t f) { H5Ldelete(f, "/VTKHDF", H5P_DEFAULT); }},
        {"no 'Points'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/Points", H5P_DEFAULT); }},
        {"no 'id'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/PointData/id", H5P_DEFAULT); }},
        {"no 'body'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/PointData/body", H5P_DEFAULT); }},
        {"no 'TimeValue'", [](hid_t f) { H5Ldelete(f, "/VTKHDF/FieldData/TimeValue", H5P_DEFAULT); }},
        {"no 'parameters'", [](hid_t f) { H5Ldelete(f, "/firn/parameters", H5P_DEFAULT); }},
        {"VTKHDF Type", [](hid_t f) { H5Adelete_by_name(f, "/VTKHDF", "Type", H5P_DEFAULT); }},
        {"schema_version is 6", [](hid_t f) { set_integer(f, "/firn", "schema_version", 6); }},
        {"schema_version is 0", [](hid_t f) { set_integer(f, "/firn", "schema_version", 0); }},
        {"no digest", [](hid_t f) { H5Adelete_by_name(f, "/firn", "digest", H5P_DEFAULT); }},
        {"'digest' is not one 64-bit unsigned integer",
         [](hid_t f) {
             H5Adelete_by_name(f, "/firn", "digest", H5P_DEFAULT);
             const firn::hdf5::Group group(H5Gopen2(f, "/firn", H5P_DEFAULT), "open");
             firn::detail::write_integers(group.id(), "digest", {1});
         }},
        {"schema_version is missing", [](hid_t f) { H5Adelete_by_name(f, "/firn", "schema_version", H5P_DEFAULT); }},
        {"dimension is neither", [](hid_t f) { set_integer(f, "/firn", "dimension", 4); }},
        {"components in 2 dimensions", [](hid_t f) { set_integer(f, "/firn", "dimension", 2); }},
        {"'mass' has 5 rows where 4", [](hid_t f) { replace(f, "/VTKHDF/PointData/mass", {5}); }},
        {"'mass' has rank 3", [](hid_t f) { replace(f, "/VTKHDF/PointData/mass", {4, 1, 1}); }},
        {"'mass' has 1025 columns", [](hid_t f) { replace(f, "/VTKHDF/PointData/mass", {4, 1025}); }},
        {"'mass' is of 32-bit integer",
         [](hid_t f) { replace(f, "/VTKHDF/PointData/mass", {4}, H5P_DEFAULT, H5T_STD_I32LE); }},
        {"'id' is of 32-bit float", [](hid_t f) { replace(f, "/VTKHDF/PointData/id", {4}); }},
        {"'id' has 2 columns", [](hid_t f) { replace(f, "/VTKHDF/PointData/id", {4, 2}, H5P_DEFAULT, H5T_STD_I64LE); }},
        {"NumberOfPoints is 4, but there are 3", [](hid_t f) { replace(f, "/VTKHDF/Points", {3, 3}); }},
        {"notes 3 components",
         [](hid_t f) {
             replace(f, "/VTKHDF/PointData/velocity", {4, 2});
             const firn::hdf5::Dataset dataset(H5Dopen2(f, "/VTKHDF/PointData/velocity", H5P_DEFAULT), "open");
             firn::detail::write_integers(dataset.id(), "components", {3});
         }},
        {"outside of the file",
         [=](hid_t f) { replace(f, "/VTKHDF/Points", {many, 3}, H5P_DEFAULT, H5T_IEEE_F32LE, false); }},
        {"more than the file's",
         [&](hid_t f) { replace(f, "/firn/parameters/grid/lower", {many}, chunked.id(), H5T_IEEE_F64LE, false); }},
        {"outside of the file",
         [&](hid_t f) { replace(f, "/VTKHDF/PointData/mass", {4}, outside.id(), H5T_IEEE_F32LE, false); }},
        {"which firn does not read", [&](hid_t f) { replace(f, "/VTKHDF/PointData/mass", {4}, unknown_filter.id()); }},
        {"link to elsewhere",
         [](hid_t f) {
             H5Ldelete(f, "/VTKHDF/PointData", H5P_DEFAULT);
             H5Lcreate_soft("/firn/parameters", f, "/VTKHDF/PointData", H5P_DEFAULT, H5P_DEFAULT);
         }},
        {"link to elsewhere",
         [](hid_t f) {
             H5Ldelete(f, "/VTKHDF/PointData/mass", H5P_DEFAULT);
             H5Lcreate_external("a.hdf", "/VTKHDF/PointData/volume", f, "/VTKHDF/PointData/mass", H5P_DEFAULT,
                                H5P_DEFAULT);
         }},
        {"name has 300 bytes",
         [](hid_t f) { replace(f, ("/VTKHDF/PointData/" + std::string(300, 'x')).c_str(), {4}); }},
        {"'a.b'", [](hid_t f) { replace(f, "/VTKHDF/PointData/a.b", {4}); }},
        {"time = inf",
         [](hid_t f) {
             const firn::hdf5::Dataset dataset(H5Dopen2(f, "/VTKHDF/FieldData/TimeValue", H5P_DEFAULT), "open");
             const double infinity = std::numeric_limits<double>::infinity();
             H5Dwrite(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &infinity);
         }},
    };
    const Folder folder;
    const auto path = folder / "forged.hdf";
    for (const auto& forgery : forgeries) {
        firn::write_state(path, example<float>(3, 4));
        {
            const firn::hdf5::Quiet quiet;  // replace() removes what is not always there
            const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
            forgery.make(file.id());
        }
        const auto message = refusal(path);
        INFO(message);
        CHECK(states::holds(message, forgery.reason));
        CHECK(states::holds(message, "forged.hdf"));
    }
}

TEST_CASE("Hard links to one large array do not let a small file ask for much memory", "[io][state]") {
    const Folder folder;
    const auto path = folder / "many.hdf";
    auto state = example<float>(3, 4);
    state.parameters.push_back({"walls", "table", "1", std::vector<double>(4096, 1.0)});
    firn::write_state(path, state);
    {
        const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
        for (int i = 0; i < 3; ++i) {
            H5Lcreate_hard(file.id(), "/firn/parameters/walls/table", file.id(),
                           ("/firn/parameters/walls/copy" + std::to_string(i)).c_str(), H5P_DEFAULT, H5P_DEFAULT);
        }
    }
    CHECK(states::holds(refusal(path), "more than the file's"));
}

TEST_CASE("A list of parameters, or a long text, that contradicts itself is refused", "[io][state]") {
    const Folder folder;
    const auto path = folder / "a.hdf";
    auto state = example<float>(3, 4);
    for (int i = 0; i < 600; ++i) state.parameters.push_back({"balls", std::to_string(i), "m", {double(i), 1}});
    state.attributes.push_back({"long", std::string(40'000, 'x')});
    const auto refused_after = [&](const std::function<void(hid_t)>& change) {
        firn::write_state(path, state);
        {
            const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
            change(file.id());
        }
        return refusal(path);
    };
    const auto with_number = [&](const char* dataset, std::size_t at, auto value) {
        return refused_after([&](hid_t f) {
            const firn::hdf5::Dataset numbers(H5Dopen2(f, dataset, H5P_DEFAULT), "open");
            const firn::hdf5::Dataspace space(H5Dget_space(numbers.id()), "space");
            std::vector<decltype(value)> all(std::size_t(H5Sget_simple_extent_npoints(space.id())));
            const hid_t type = firn::hdf5::Number<decltype(value)>::memory();
            H5Dread(numbers.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data());
            all[at < all.size() ? at : all.size() - 1] = value;
            H5Dwrite(numbers.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data());
        });
    };
    const char *counts = "/firn/parameter_list/counts", *texts = "/firn/parameter_list/texts";
    constexpr std::size_t last = std::size_t(-1);
    const char* contradiction = "the arrays of its parameter_list contradict each other";
    for (const std::int64_t count :
         {std::int64_t(0), std::int64_t(3), std::int64_t(-2), std::numeric_limits<std::int64_t>::max(),
          std::numeric_limits<std::int64_t>::min()})
        for (const std::size_t at : {std::size_t(0), last})
            CHECK(states::holds(with_number(counts, at, count), contradiction));
    CHECK(states::holds(with_number(texts, last, std::uint8_t('m')), contradiction));      // a text without end
    CHECK(states::holds(with_number(texts, last - 1, std::uint8_t('m')), contradiction));  // the same
    CHECK(states::holds(with_number("/firn/parameter_list/values", 9, 0.5), "does not match its digest"));
    CHECK(states::holds(with_number("/firn/texts/long", 9, std::uint8_t('y')), "does not match its digest"));
    CHECK(states::holds(with_number("/firn/texts/long", 9, std::uint8_t(0)), "of which one is zero"));
    CHECK(states::holds(refused_after([](hid_t f) { H5Ldelete(f, "/firn/parameter_list/counts", H5P_DEFAULT); }),
                        "no 'counts'"));
    CHECK(states::holds(refused_after([](hid_t f) { H5Ldelete(f, "/firn/parameter_list", H5P_DEFAULT); }),
                        "does not match its digest"));
    CHECK(states::holds(refused_after([](hid_t f) { H5Ldelete(f, "/firn/texts", H5P_DEFAULT); }),
                        "does not match its digest"));
}

TEST_CASE("A state of 2D with points off the plane is refused, not flattened", "[io][state]") {
    const Folder folder;
    firn::write_state(folder / "a.hdf", example<float>(2, 2));
    {
        const firn::hdf5::File file(H5Fopen((folder / "a.hdf").c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
        const firn::hdf5::Dataset points(H5Dopen2(file.id(), "/VTKHDF/Points", H5P_DEFAULT), "open");
        const float values[6] = {0, 0, 0, 0, 0, 0.25f};
        H5Dwrite(points.id(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
    }
    CHECK(states::holds(refusal(folder / "a.hdf"), "its row 1 has a third component 0.25"));
}

TEST_CASE("A field that another program added is read without a unit, by a reader that does not verify",
          "[io][state]") {
    const Folder folder;
    firn::write_state(folder / "a.hdf", example<float>(3, 4));
    {
        const firn::hdf5::Quiet quiet;
        const firn::hdf5::File file(H5Fopen((folder / "a.hdf").c_str(), H5F_ACC_RDWR, H5P_DEFAULT), "open");
        const hsize_t chunk[2] = {2, 2};
        const firn::hdf5::Properties packed(H5Pcreate(H5P_DATASET_CREATE), "layout");
        H5Pset_chunk(packed.id(), 2, chunk);
        H5Pset_deflate(packed.id(), 9);
        H5Pset_fletcher32(packed.id());
        replace(file.id(), "/VTKHDF/PointData/added", {4, 2}, packed.id(), H5T_IEEE_F32BE);
    }
    CHECK(states::holds(refusal(folder / "a.hdf"), "does not match its digest"));
    const auto field = firn::read_state<float>(folder / "a.hdf", {.verify = false}).field("added");
    CHECK(field == firn::StateField<float>{"added", "", 2, std::vector<float>(8, 0.0f)});
}

}  // namespace state_reader_tests
