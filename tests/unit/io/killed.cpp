/// \file A program that is killed while it writes: what was said to be on disk is there, and nothing in sight is
/// broken.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/io/background_series.hpp>
#include <firn/io/state_reader.hpp>

#include "example_state.hpp"
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

using states::Folder;

namespace {

/// Writes states without end, and a byte to `said` for each that is on disk.
[[noreturn]] void write_states(const std::filesystem::path& folder, int said) {
    firn::BackgroundSeries<float> series(folder, "run");
    auto state = states::example<float>(3, 2000);
    for (std::size_t told = 0;; state.time += 1) {
        series.write(firn::State<float>(state));
        for (const std::size_t written = series.size(); told < written; ++told)
            if (::write(said, "+", 1) != 1) ::_exit(1);
    }
}

struct Found {
    long acknowledged = 0, lost = 0, unreadable = 0;
};

/// Runs, is killed after some milliseconds, and what it left is looked through.
void kill_one(int milliseconds, Found& found) {
    const Folder folder;
    int ends[2];
    REQUIRE(::pipe(ends) == 0);
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        ::close(ends[0]);
        write_states(folder.path(), ends[1]);
    }
    ::close(ends[1]);
    ::usleep(useconds_t(milliseconds * 1000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    long acknowledged = 0;
    char bytes[4096];
    for (ssize_t got = 0; (got = ::read(ends[0], bytes, sizeof bytes)) > 0;) acknowledged += got;
    ::close(ends[0]);

    found.acknowledged += acknowledged;
    long listed = 0;
    if (std::filesystem::exists(folder / "run.hdf.series"))
        listed = long(firn::read_series(folder / "run.hdf.series").size());
    found.lost += std::max(0L, acknowledged - listed);
    for (const std::string& name : folder.names()) {
        if (!name.ends_with(".hdf")) continue;
        try {
            static_cast<void>(firn::read_state<float>(folder / name));
        } catch (const firn::error&) {
            ++found.unreadable;
        }
    }
}

void kill_many(int runs, std::uint64_t seed) {
    test_support::Random random(seed);
    Found found;
    for (int i = 0; i < runs; ++i) kill_one(int(random.uniform(1, 300)), found);
    // Sanitized and beside other programs 300 ms can be too few for a first state.
    for (int i = 0; i < 5 && found.acknowledged == 0; ++i) kill_one(4000, found);
    INFO(found.acknowledged << " states were acknowledged in " << runs << " runs");
    CHECK(found.lost == 0);
    CHECK(found.unreadable == 0);
    CHECK(found.acknowledged > 0);
}

}  // namespace

TEST_CASE("No state that was acknowledged is lost to SIGKILL, and no broken one is in sight", "[io][series]") {
    kill_many(10, 1);
}
TEST_CASE("The same for a hundred runs", "[io][series][.full]") { kill_many(100, 2); }
