/// \file States that are written while their run goes on: the same files, in order, none lost, few in memory.
#include "support/catch.hpp"
#include <firn/io/background_series.hpp>
#include <firn/io/state_reader.hpp>

#include "example_state.hpp"

using states::example;
using states::Folder;

namespace {

firn::State<float> state_at(int time, std::size_t particles = 50) {
    auto state = example<float>(3, particles);
    state.time = time;
    return state;
}

}  // namespace

TEST_CASE("A series in the background is the series in the foreground, byte for byte", "[io][series]") {
    const Folder folder;
    firn::StateSeries before(folder / "fore", "run");
    firn::BackgroundSeries<float> series(folder / "back", "run");
    for (int i = 0; i < 12; ++i) {
        before.write(state_at(i));
        series.write(state_at(i));
    }
    series.finish();
    CHECK(series.size() == 12);
    for (int i = 0; i < 12; ++i) {
        const std::string name = "run_00" + std::string(i < 10 ? "0" : "") + std::to_string(i) + ".hdf";
        CHECK(states::bytes_of(folder / "fore" / name) == states::bytes_of(folder / "back" / name));
    }
    CHECK(states::bytes_of(before.path()) == states::bytes_of(series.path()));
    // The memory of a state that was written is given back, once.
    CHECK(series.spare().size() == 50);
    CHECK(series.spare().size() == 0);
}

TEST_CASE("What a background series holds is on disk when it ends", "[io][series]") {
    const Folder folder;
    {
        firn::BackgroundSeries<float> series(folder.path(), "run");
        for (int i = 0; i < 5; ++i) series.write(state_at(i, 3000));
    }
    CHECK(firn::read_series(folder / "run.hdf.series").size() == 5);
    CHECK(firn::read_state<float>(folder / "run_0004.hdf").time == 4);
}

TEST_CASE("Several series and a reader share HDF5 without harm", "[io][series]") {
    const Folder folder;
    firn::write_state(folder / "alone.hdf", state_at(7));
    firn::BackgroundSeries<float> first(folder.path(), "first");
    firn::BackgroundSeries<double> second(folder.path(), "second");
    for (int i = 0; i < 20; ++i) {
        first.write(state_at(i));
        second.write(example<double>(2, 40));
        CHECK(firn::read_state<float>(folder / "alone.hdf").time == 7);
    }
    first.finish();
    second.finish();
    CHECK(firn::read_series(first.path()).size() == 20);
    CHECK(firn::read_series(second.path()).size() == 20);
}

TEST_CASE("A state that cannot be written is reported, kept and tried again", "[io][series]") {
    const Folder folder;
    const auto place = folder / "states", away = folder / "elsewhere";
    firn::BackgroundSeries<float> series(place, "run");
    series.write(state_at(0));
    series.finish();
    std::filesystem::rename(place, away);  // the disk is gone
    series.write(state_at(1));
    CHECK_THROWS_AS(series.finish(), firn::io_error);
    CHECK_THROWS_AS(series.finish(), firn::io_error);  // tried again, and no better
    std::filesystem::rename(away, place);
    try {
        series.finish();
    } catch (const firn::io_error&) {  // the attempt that was under way
        series.finish();
    }
    series.write(state_at(2));
    series.finish();
    CHECK(series.size() == 3);
    const auto listed = firn::read_series(series.path());
    REQUIRE(listed.size() == 3);
    for (int i = 0; i < 3; ++i) CHECK(listed[std::size_t(i)].time == i);
    CHECK(firn::read_state<float>(place / "run_0001.hdf").time == 1);
}
