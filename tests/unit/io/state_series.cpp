#include "support/catch.hpp"
#include <firn/io/state_reader.hpp>
#include <firn/io/state_series.hpp>

#include "example_state.hpp"

using states::example;
using states::Folder;

namespace state_series_tests {

using Names = std::set<std::string>;

namespace {

firn::State<float> at_time(double time) {
    auto state = example<float>(3, 2);
    state.time = time;
    return state;
}

}  // namespace

TEST_CASE("A series holds its states and lists their times after each write", "[io][series]") {
    const Folder folder;
    firn::StateSeries series(folder / "made/on/the/way", "fall");
    const std::vector<double> times = {0, 0.1, 1.0 / 3, 1e-7};
    for (std::size_t i = 0; i < times.size(); ++i) {
        const auto path = series.write(at_time(times[i]));
        CHECK(path.filename() == "fall_000" + std::to_string(i) + ".hdf");
        CHECK(firn::read_state<float>(path).time == times[i]);
        const auto listed = firn::read_series(series.path());
        CHECK(listed == series.entries());
        REQUIRE(listed.size() == i + 1);
        CHECK(listed[i].file == path.filename());
        CHECK(listed[i].time == times[i]);
    }
    CHECK(series.path() == folder / "made/on/the/way/fall.hdf.series");
}

TEST_CASE("A series begun afresh replaces the old one's states, and nothing else", "[io][series]") {
    const Folder folder;
    {
        firn::StateSeries old(folder.path(), "run");
        for (int i = 0; i < 4; ++i) old.write(at_time(i));
    }
    // Not listed, or not called as states of this series are: none of them may go.
    for (const char* name : {"run_0009.hdf", "run_0001.png", "run_01.hdf", "other_0001.hdf", "run_000x.hdf"}) {
        states::put_bytes(folder / name, "mine");
    }
    auto listed = firn::read_series(folder / "run.hdf.series");
    for (const char* name : {"run_01.hdf", "other_0001.hdf", "run_000x.hdf", "run_0001.png"}) {
        listed.push_back({name, 9});
    }
    firn::write_series(folder / "run.hdf.series", listed);
    const Names others = {"run_0009.hdf", "run_0001.png", "run_01.hdf", "other_0001.hdf", "run_000x.hdf"};

    firn::StateSeries fresh(folder.path(), "run");
    auto expected = others;
    expected.insert({"run.hdf.series", "run_0000.hdf", "run_0001.hdf", "run_0002.hdf", "run_0003.hdf"});
    CHECK(folder.names() == expected);  // nothing happens before the first write

    fresh.write(at_time(50));
    expected = others;
    expected.insert({"run.hdf.series", "run_0000.hdf"});
    CHECK(folder.names() == expected);
    CHECK(firn::read_series(fresh.path()) == std::vector<firn::SeriesEntry>{{"run_0000.hdf", 50}});

    fresh.write(at_time(51));
    CHECK(firn::read_state<float>(folder / "run_0001.hdf").time == 51);
}

TEST_CASE("An old list that cannot be read is replaced, and no state is removed", "[io][series]") {
    const Folder folder;
    states::put_bytes(folder / "run.hdf.series", "{\"files\":[{\"name\":\"run_0001.hdf\",");
    states::put_bytes(folder / "run_0001.hdf", "mine");
    firn::StateSeries(folder.path(), "run").write(at_time(0));
    CHECK(folder.names() == Names{"run.hdf.series", "run_0000.hdf", "run_0001.hdf"});
    CHECK(firn::read_series(folder / "run.hdf.series").size() == 1);
}

TEST_CASE("A write that fails leaves the series as it was, and the next takes its number", "[io][series]") {
    const Folder folder;
    firn::StateSeries series(folder.path(), "run");
    series.write(at_time(0));
    std::filesystem::create_directory(folder / "run_0001.hdf");
    CHECK_THROWS_AS(series.write(at_time(1)), firn::io_error);
    CHECK(firn::read_series(series.path()).size() == 1);
    std::filesystem::remove(folder / "run_0001.hdf");

    // The list cannot be replaced: the state is not counted.
    std::filesystem::remove(series.path());
    std::filesystem::create_directory(series.path());
    CHECK_THROWS_AS(series.write(at_time(1)), firn::io_error);
    CHECK(series.size() == 1);
    std::filesystem::remove(series.path());

    CHECK(series.write(at_time(2)).filename() == "run_0001.hdf");
    CHECK(firn::read_series(series.path()).size() == 2);
    CHECK(folder.names() == Names{"run.hdf.series", "run_0000.hdf", "run_0001.hdf"});
}

TEST_CASE("A first state that fails leaves an older series untouched", "[io][series]") {
    const Folder folder;
    firn::StateSeries old(folder.path(), "run");
    for (int i = 0; i < 3; ++i) old.write(at_time(i));
    const auto names = folder.names();

    auto broken = at_time(7);
    broken.body.clear();
    CHECK_THROWS_AS(firn::StateSeries(folder.path(), "run").write(broken), firn::parameter_error);
    CHECK(folder.names() == names);
    CHECK(firn::read_series(old.path()) == old.entries());
    for (int i = 0; i < 3; ++i) {
        CHECK(firn::read_state<float>(folder / ("run_000" + std::to_string(i) + ".hdf")).time == i);
    }
}

TEST_CASE("A series needs a name for files and a folder", "[io][series]") {
    const Folder folder;
    for (const char* name : {"", "a/b", "a.b", "..", "a\nb"}) {
        CHECK_THROWS_AS(firn::StateSeries(folder.path(), name), firn::parameter_error);
    }
    states::put_bytes(folder / "file", "");
    CHECK_THROWS_AS(firn::StateSeries(folder / "file", "run"), firn::io_error);
    CHECK_THROWS_AS(firn::StateSeries(folder / "file/below", "run"), firn::io_error);
}

TEST_CASE("A series that goes on keeps its states up to the restart, and replaces later ones", "[io][series]") {
    const Folder folder;
    {
        firn::StateSeries old(folder.path(), "run");
        for (int i = 0; i < 5; ++i) old.write(at_time(i));
    }
    firn::StateSeries on(folder.path(), "run");
    on.go_on_from(2);
    CHECK(on.size() == 3);
    CHECK(firn::read_series(on.path()).size() == 5);  // nothing happens before the first write
    on.write(at_time(2.5));
    CHECK(folder.names() == Names{"run.hdf.series", "run_0000.hdf", "run_0001.hdf", "run_0002.hdf", "run_0003.hdf"});
    CHECK(firn::read_series(on.path()) ==
          std::vector<firn::SeriesEntry>{
              {"run_0000.hdf", 0}, {"run_0001.hdf", 1}, {"run_0002.hdf", 2}, {"run_0003.hdf", 2.5}});
    CHECK(firn::read_state<float>(folder / "run_0003.hdf").time == 2.5);

    // A state that was taken out of the middle of the list does not let a later one be written over.
    firn::write_series(on.path(), {{"run_0000.hdf", 0}, {"run_0002.hdf", 2}});
    firn::StateSeries again(folder.path(), "run");
    again.go_on_from(2);
    again.write(at_time(3));
    CHECK(firn::read_series(again.path()).back() == firn::SeriesEntry{"run_0003.hdf", 3});
    CHECK(firn::read_state<float>(folder / "run_0002.hdf").time == 2);

    CHECK_THROWS_AS(firn::StateSeries(folder.path(), "other").go_on_from(0), firn::io_error);
    firn::write_series(on.path(), {{"../elsewhere.hdf", 0}});
    CHECK_THROWS_AS(again.go_on_from(0), firn::io_error);
}

TEST_CASE("Of a series with selected fields every n-th state is complete", "[io][series]") {
    const Folder folder;
    firn::StateSeries series(folder.path(), "run", {.fields = {"velocity"}, .complete_every = 3});
    for (int i = 0; i < 7; ++i) {
        const auto state = firn::read_state<float>(series.write(at_time(i)));
        CHECK(state.fields.size() == (i % 3 == 0 ? example<float>(3, 2).fields.size() : 2));
    }
}

}  // namespace state_series_tests
