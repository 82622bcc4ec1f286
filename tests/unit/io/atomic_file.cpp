/// \file firn/io/atomic_file.hpp: a file appears whole or not at all, and every failure is an error.
#include "support/catch.hpp"
#include "support/message.hpp"
#include "support/temporary_folder.hpp"
#include <firn/io/atomic_file.hpp>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

using namespace firn;
using test_support::check_refused;

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
    check_refused<io_error>([&] { AtomicFile file(taken); }, "it is a folder");
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

TEST_CASE("A symbolic link stays, and the file to which it leads is written") {
    const TemporaryFolder folder, elsewhere;
    const auto link = folder.path() / "link", file = elsewhere.path() / "file", second = folder.path() / "second";
    std::filesystem::create_symlink("link", second);  // relative, to a link
    std::filesystem::create_symlink(file, link);
    for (const auto& [name, text] : {std::pair{second, "first"}, {link, "other"}}) {  // not there, and there
        AtomicFile out(name);
        out.write(text);
        CHECK(out.temporary().parent_path() == elsewhere.path());  // on the same file system
        out.commit();
        CHECK(content(file) == text);
    }
    put(temporary_name(file), "third");
    sync_and_rename(temporary_name(file), second);
    CHECK(content(file) == "third");
    CHECK(std::filesystem::read_symlink(link) == file);
    CHECK(std::filesystem::read_symlink(second) == "link");
    CHECK(folder.count() == 2);
    CHECK(elsewhere.count() == 1);

    std::filesystem::remove(link);
    std::filesystem::create_symlink("second", link);  // a circle
    check_refused<io_error>([&] { AtomicFile out(link); }, "too many symbolic links");
}

TEST_CASE("A pipe, a device, a socket or an open file is refused, and stays what it is") {
    const TemporaryFolder folder;
    const auto refused = [&](const std::filesystem::path& path, const std::string& what) {
        const auto before = std::filesystem::status(path).type();
        check_refused<io_error>([&] { AtomicFile out(path); }, what);
        put(folder.path() / "new", "new");
        check_refused<io_error>([&] { sync_and_rename(folder.path() / "new", path); }, what);
        CHECK(std::filesystem::status(path).type() == before);
    };
    const auto pipe = folder.path() / "pipe", to_pipe = folder.path() / "to pipe", to_null = folder.path() / "to null";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    std::filesystem::create_symlink("pipe", to_pipe);
    std::filesystem::create_symlink("/dev/null", to_null);
    refused(pipe, "it is a pipe");
    refused(to_pipe, "it is a pipe");
    refused("/dev/null", "it is a device");
    refused(to_null, "it is a device");
    CHECK(folder.count() == 3);

    const auto name = folder.path() / "socket";
    const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name.string().copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    refused(name, "it is a socket");
    ::close(socket);

    put(folder.path() / "open", "old");
    const int open = ::open((folder.path() / "open").c_str(), O_RDONLY);
    const std::filesystem::path of_process = "/proc/self/fd/" + std::to_string(open);
    if (std::filesystem::exists(of_process)) refused(of_process, "it is an open file of a process");
    ::close(open);
    CHECK(content(folder.path() / "open") == "old");

    // What takes the name's place while the file is written stays, too.
    const auto late = folder.path() / "late";
    AtomicFile out(late);
    REQUIRE(::mkfifo(late.c_str(), 0600) == 0);
    check_refused<io_error>([&] { out.commit(); }, "it is a pipe");
    CHECK(std::filesystem::is_fifo(late));
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
