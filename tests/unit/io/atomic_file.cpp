/// \file firn/io/atomic_file.hpp: a file appears whole or not at all, and every failure is an error.
#include "support/catch.hpp"
#include "support/temporary_folder.hpp"
#include <firn/io/atomic_file.hpp>

#include <fstream>
#include <iterator>

using namespace firn;

namespace atomic_file_tests {
namespace {
std::string content(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}
void put(const std::filesystem::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
}  // namespace

TEST_CASE("Before commit the old file stands, after it the new one, and no temporary file stays") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "state.hdf";
    put(path, "old");
    const std::string block(50000, 'x');  // more than one buffer in all
    {
        AtomicFile file(path);
        for (int i = 0; i < 5; ++i) file.write(block);
        CHECK(content(path) == "old");
        CHECK(file.temporary().parent_path() == path.parent_path());
        CHECK(file.temporary().extension() != ".hdf");
        file.commit();
        CHECK(content(path).size() == 5 * block.size());
        CHECK_THROWS_AS(file.commit(), io_error);
    }
    CHECK(content(path).size() == 5 * block.size());
    CHECK(folder.count() == 1);
}

TEST_CASE("Without a commit (an exception on the way) nothing changes") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "state.hdf";
    put(path, "old");
    {
        AtomicFile file(path);
        file.write("half");
        CHECK(folder.count() == 2);
    }
    CHECK(content(path) == "old");
    CHECK(folder.count() == 1);
}

TEST_CASE("A full disk, a missing folder, a folder in the file's place: io_error, nothing left behind") {
    const TemporaryFolder folder;
    CHECK_THROWS_AS(AtomicFile(folder.path() / "missing" / "a"), io_error);

    const auto taken = folder.path() / "taken";
    std::filesystem::create_directory(taken);
    {
        AtomicFile file(taken);
        file.write("text");
        CHECK_THROWS_AS(file.commit(), io_error);
    }
    CHECK(folder.count() == 1);

    // /dev/full answers every write with "no space left on device".
    const auto full = folder.path() / "full";
    if (std::filesystem::exists("/dev/full")) {
        std::filesystem::create_symlink("/dev/full", temporary_name(full));
        AtomicFile file(full);
        CHECK_THROWS_AS(file.write(std::string(std::size_t(1) << 17, 'x')), io_error);
        CHECK_THROWS_AS(file.commit(), io_error);
        CHECK(!std::filesystem::exists(full));
    }
}

TEST_CASE("sync_and_rename puts another library's file in its place, or removes it") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "state.hdf";
    put(path, "old");
    put(temporary_name(path), "new");
    sync_and_rename(temporary_name(path), path);
    CHECK(content(path) == "new");
    CHECK(folder.count() == 1);

    CHECK_THROWS_AS(sync_and_rename(folder.path() / "missing", path), io_error);
    CHECK(content(path) == "new");
    put(temporary_name(path), "newer");
    std::filesystem::create_directory(folder.path() / "taken");
    CHECK_THROWS_AS(sync_and_rename(temporary_name(path), folder.path() / "taken"), io_error);
    CHECK(!std::filesystem::exists(temporary_name(path)));
}

}  // namespace atomic_file_tests
