/// \file A program that is killed while it writes: what was said to be on disk is there, and nothing in sight is
/// broken.
#include "support/catch.hpp"
#include "support/random_numbers.hpp"
#include <firn/io/background_series.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/usd_series.hpp>

#include "example_state.hpp"
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

using states::Folder;

namespace {

/// A series of states.
struct OfStates {
    using Series = firn::StateSeries;
    static constexpr const char *list = "run.hdf.series", *ending = ".hdf";
    static Series::Options options() { return {}; }
    static firn::State<float> state() { return states::example<float>(3, 2000); }
    static firn::State<float> frame(const firn::State<float>& state) { return state; }
    static auto read_list(const std::filesystem::path& path) { return firn::read_series(path); }
    static void read(const std::filesystem::path& path) { static_cast<void>(firn::read_state<float>(path)); }
};

/// A USD stage.
struct OfStages {
    using Series = firn::UsdSeries;
    static constexpr const char *list = "run.usda", *ending = ".usda";
    static Series::Options options() { return {.width = 0.1}; }
    static firn::State<float> state() {
        auto state = states::example<float>(3, 2000);
        for (auto& field : state.fields) field.values.assign(field.values.size(), 0.5F);
        return state;
    }
    static std::vector<firn::UsdPrim<float>> frame(const firn::State<float>& state) { return {{"points", state}}; }
    static auto read_list(const std::filesystem::path& path) { return firn::detail::read_usd_list(path); }
    static void read(const std::filesystem::path& path) {
        const std::string text = states::bytes_of(path);
        if (!text.starts_with("#usda 1.0\n") || !text.ends_with("\n}\n")) throw firn::io_error("It is not whole.");
    }
};

/// Writes states without end, and a byte to `said` for each that is on disk.
template <class Of>
[[noreturn]] void write_states(const std::filesystem::path& folder, int said) {
    firn::BackgroundSeries<float, typename Of::Series> series(folder, "run", Of::options());
    auto state = Of::state();
    for (std::size_t told = 0;; state.time += 1) {
        series.write(Of::frame(state));
        for (const std::size_t written = series.size(); told < written; ++told)
            if (::write(said, "+", 1) != 1) ::_exit(1);
    }
}

struct Found {
    long acknowledged = 0, lost = 0, unreadable = 0;
};

/// Runs, is killed after some milliseconds, and what it left is looked through.
template <class Of>
void kill_one(int milliseconds, Found& found) {
    const Folder folder;
    int ends[2];
    REQUIRE(::pipe(ends) == 0);
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        ::close(ends[0]);
        write_states<Of>(folder.path(), ends[1]);
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
    std::set<std::string> listed;
    if (std::filesystem::exists(folder / Of::list))
        for (const auto& entry : Of::read_list(folder / Of::list)) listed.insert(entry.file);
    found.lost += std::max(0L, acknowledged - long(listed.size()));
    const std::set<std::string> names = folder.names();
    for (const std::string& name : listed) found.lost += !names.contains(name);
    for (const std::string& name : names) {
        if (!name.ends_with(Of::ending)) continue;
        try {
            Of::read(folder / name);
        } catch (const firn::error&) {
            ++found.unreadable;
        }
    }
}

template <class Of>
void kill_many(int runs, std::uint64_t seed) {
    test_support::Random random(seed);
    Found found;
    for (int i = 0; i < runs; ++i) kill_one<Of>(int(random.uniform(1, 300)), found);
    // Sanitized and beside other programs 300 ms can be too few for a first state.
    for (int i = 0; i < 5 && found.acknowledged == 0; ++i) kill_one<Of>(4000, found);
    INFO(found.acknowledged << " states were acknowledged in " << runs << " runs");
    CHECK(found.lost == 0);
    CHECK(found.unreadable == 0);
    CHECK(found.acknowledged > 0);
}

}  // namespace

TEST_CASE("No state that was acknowledged is lost to SIGKILL, and no broken one is in sight", "[io][series]") {
    kill_many<OfStates>(10, 1);
}
TEST_CASE("No sample of a USD stage that was acknowledged is lost to SIGKILL, and none is broken",
          "[io][usd][series]") {
    kill_many<OfStages>(5, 3);
}
TEST_CASE("The same for a hundred runs", "[io][series][.full]") { kill_many<OfStates>(100, 2); }
