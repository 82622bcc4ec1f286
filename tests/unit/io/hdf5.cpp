#include "support/catch.hpp"
#include <firn/io/hdf5.hpp>

#include "example_state.hpp"

TEST_CASE("A failed call throws what was tried and HDF5's reason, and prints nothing", "[io][hdf5]") {
    const states::Folder folder;
    const auto path = folder / "none.hdf";
    const auto message = states::message<firn::io_error>([&] {
        firn::hdf5::naming_file(path, [&] {
            H5E_auto2_t printer = nullptr;
            void* data = nullptr;
            H5Eget_auto2(H5E_DEFAULT, &printer, &data);
            CHECK(printer == nullptr);
            const firn::hdf5::File file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), "open it");
        });
    });
    CHECK(states::holds(message, "none.hdf\": could not open it ("));
    CHECK(states::holds(message, "No such file or directory"));
    // The user's own setting is back.
    H5E_auto2_t printer = nullptr;
    void* data = nullptr;
    H5Eget_auto2(H5E_DEFAULT, &printer, &data);
    CHECK(printer != nullptr);
}

TEST_CASE("An owner closes once, also after a move and an exception", "[io][hdf5]") {
    hid_t id = -1;
    {
        firn::hdf5::Dataspace first(H5Screate(H5S_SCALAR), "create");
        id = first.id();
        firn::hdf5::Dataspace second(std::move(first));
        CHECK(first.id() < 0);
        CHECK(H5Iis_valid(id) > 0);
        first = std::move(second);
        CHECK(first.id() == id);
    }
    CHECK(H5Iis_valid(id) == 0);
    try {
        const firn::hdf5::Dataspace space(H5Screate(H5S_SCALAR), "create");
        id = space.id();
        throw firn::io_error("on the way");
    } catch (const firn::io_error&) {
    }
    CHECK(H5Iis_valid(id) == 0);

    firn::hdf5::Dataspace closed(H5Screate(H5S_SCALAR), "create");
    closed.close("close");
    const firn::hdf5::Quiet quiet;
    CHECK_THROWS_AS(closed.close("close again"), firn::io_error);
}

TEMPLATE_TEST_CASE("Each number has its type, recognised in either byte order and as no other", "[io][hdf5]", float,
                   double, std::uint8_t, std::int32_t, std::int64_t, std::uint64_t) {
    using firn::hdf5::Number;
    CHECK(H5Tget_size(Number<TestType>::memory()) == sizeof(TestType));
    CHECK(H5Tget_size(Number<TestType>::file()) == sizeof(TestType));
    const hid_t all[] = {Number<float>::file(),
                         Number<double>::file(),
                         Number<std::uint8_t>::file(),
                         Number<std::int32_t>::file(),
                         Number<std::int64_t>::file(),
                         Number<std::uint64_t>::file(),
                         H5T_STD_U32LE,
                         H5T_C_S1};
    int matches = 0;
    for (const hid_t id : all) {
        const firn::hdf5::Datatype type(H5Tcopy(id), "copy");
        if (!firn::hdf5::is_number<TestType>(type)) continue;
        ++matches;
        CHECK(firn::hdf5::type_name(type) == Number<TestType>::name);
    }
    CHECK(matches == 1);
    const firn::hdf5::Datatype big_endian(H5Tcopy(Number<TestType>::big_endian()), "copy");
    CHECK(firn::hdf5::is_number<TestType>(big_endian));
    CHECK(H5Tget_size(big_endian.id()) == sizeof(TestType));
}
