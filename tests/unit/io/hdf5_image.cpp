#include "support/catch.hpp"
#include <firn/io/hdf5_image.hpp>

#include "example_state.hpp"

#include <numeric>

using firn::hdf5::Dataset;
using firn::hdf5::Dataspace;
using firn::hdf5::FileImage;
using firn::hdf5::Properties;

namespace {

Dataset create(const FileImage& image, const std::string& name, hsize_t size, H5D_alloc_time_t allocate) {
    const Dataspace space(H5Screate_simple(1, &size, nullptr), "space");
    const Properties layout(H5Pcreate(H5P_DATASET_CREATE), "layout");
    H5Pset_alloc_time(layout.id(), allocate);
    H5Pset_fill_time(layout.id(), H5D_FILL_TIME_NEVER);
    return {H5Dcreate2(image.id(), name.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, layout.id(), H5P_DEFAULT),
            name};
}

}  // namespace

TEST_CASE("An image is the file that HDF5 reads, placed arrays and its own mixed in any order", "[io][hdf5]") {
    const states::Folder folder;
    std::vector<double> values(40'000);  // 320 kB: placed
    std::iota(values.begin(), values.end(), 1.0);
    // Little room at the front: HDF5's own lies before, between and behind the arrays. Much: all before them.
    for (const std::size_t front : {2048, 65536}) {
        FileImage image(front);
        REQUIRE(FileImage::can_place(std::span<const double>(values)));
        std::vector<Dataset> placed;
        for (int i = 0; i < 12; ++i) {
            placed.push_back(create(image, "placed" + std::to_string(i), values.size(), H5D_ALLOC_TIME_EARLY));
            const auto given = create(image, "given" + std::to_string(i), 300, H5D_ALLOC_TIME_EARLY);
            H5Dwrite(given.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
        }
        for (auto last = placed.rbegin(); last != placed.rend(); ++last) {
            image.place(*last, std::span<const double>(values));
        }
        placed.clear();
        image.close();
        firn::AtomicFile file(folder / "a.hdf");
        image.write(file);
        file.commit();

        const firn::hdf5::File read(H5Fopen((folder / "a.hdf").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), "open");
        for (int i = 0; i < 12; ++i) {
            for (const auto& [name, size] : {std::pair{"placed", values.size()}, {"given", std::size_t(300)}}) {
                const Dataset dataset(H5Dopen2(read.id(), (name + std::to_string(i)).c_str(), H5P_DEFAULT), name);
                std::vector<double> found(size);
                H5Dread(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, found.data());
                CHECK(std::equal(found.begin(), found.end(), values.begin()));
            }
        }
        hsize_t length = 0;
        H5Fget_filesize(read.id(), &length);
        CHECK(length == std::filesystem::file_size(folder / "a.hdf"));
    }
}

TEST_CASE("An array is placed only where the file has room of its size for it", "[io][hdf5]") {
    FileImage image(2048);
    const std::vector<double> values(40'000);
    const auto early = create(image, "early", values.size(), H5D_ALLOC_TIME_EARLY);
    const auto late = create(image, "late", values.size(), H5D_ALLOC_TIME_LATE);
    const std::span<const double> all(values);
    CHECK_THROWS_AS(image.place(late, all), firn::io_error);
    CHECK_THROWS_AS(image.place(early, all.first(39'999)), firn::io_error);
    CHECK_NOTHROW(image.place(early, all));
    CHECK(!FileImage::can_place(all.first(100)));
}
