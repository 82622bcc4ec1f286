#include "support/catch.hpp"
#include <firn/io/series_file.hpp>

#include "example_state.hpp"

#include <limits>

using Entries = std::vector<firn::SeriesEntry>;

TEST_CASE("A list is written as ParaView reads it, each time exactly", "[io][series]") {
    const states::Folder folder;
    const Entries entries = {{"a_0000.hdf", 0}, {"a_0001.hdf", 0.1}, {"\"\\_0002.hdf", 1.0 / 3 * 1e-9}};
    firn::write_series(folder / "a.hdf.series", entries);
    CHECK(states::bytes_of(folder / "a.hdf.series") ==
          "{\n  \"file-series-version\": \"1.0\",\n  \"files\": [\n"
          "    {\"name\": \"a_0000.hdf\", \"time\": 0},\n"
          "    {\"name\": \"a_0001.hdf\", \"time\": 0.1},\n"
          "    {\"name\": \"\\\"\\\\_0002.hdf\", \"time\": 3.333333333333333e-10}\n  ]\n}\n");
    CHECK(firn::read_series(folder / "a.hdf.series") == entries);
    firn::write_series(folder / "a.hdf.series", {});
    CHECK(firn::read_series(folder / "a.hdf.series").empty());

    const Entries odd = {{"a line\n and a \t tab_0000.hdf", 0}};
    firn::write_series(folder / "a.hdf.series", odd);
    CHECK(states::holds(states::bytes_of(folder / "a.hdf.series"), "a line\\u000a and a \\u0009 tab_0000.hdf"));
    CHECK(firn::read_series(folder / "a.hdf.series") == odd);
}

TEST_CASE("A list of another program is read: other order, other members, no space", "[io][series]") {
    const states::Folder folder;
    states::put_bytes(folder / "a.hdf.series",
                      R"({"x":[1,{"y":null}],"files":[{"time":-1e-3,"size":[true,"a"],"name":"b\/c"}],"z":{}} )");
    CHECK(firn::read_series(folder / "a.hdf.series") == Entries{{"b/c", -1e-3}});
}

TEST_CASE("A list that is broken is refused with its name and the place", "[io][series]") {
    const states::Folder folder;
    const auto path = folder / "a.hdf.series";
    CHECK(states::holds(states::message<firn::io_error>([&] { return firn::read_series(path); }), "a.hdf.series"));
    const std::string good = R"({"files":[{"name":"a","time":1}]})";
    states::put_bytes(path, good);
    REQUIRE(firn::read_series(path) == Entries{{"a", 1}});
    for (std::size_t length = 0; length < good.size(); ++length) {
        CAPTURE(length);
        states::put_bytes(path, good.substr(0, length));
        CHECK(
            states::holds(states::message<firn::io_error>([&] { return firn::read_series(path); }), "broken at byte"));
    }
    for (const std::string wrong :
         {R"([])", R"({})", R"({"files":{}})", R"({"files":[1]})", R"({"files":[{"name":1,"time":1}]})",
          R"({"files":[{"name":"a"}]})", R"({"files":[{"time":1}]})", R"({"files":[{"name":"a","time":nan}]})",
          R"({"files":[{"name":"a","time":1e999}]})", R"({"files":[{"name":"\u00g1","time":1}]})",
          R"({"files":[]}x)"}) {
        CAPTURE(wrong);
        states::put_bytes(path, wrong);
        CHECK_THROWS_AS(firn::read_series(path), firn::io_error);
    }
    states::put_bytes(path, "{\"x\":" + std::string(100'000, '['));
    CHECK_THROWS_AS(firn::read_series(path), firn::io_error);
}

TEST_CASE("States of a series are told from other files by their names", "[io][series]") {
    using firn::detail::is_series_member;
    using firn::detail::series_member;
    CHECK(series_member("run", 7) == "run_0007.hdf");
    CHECK(series_member("run", 12'345) == "run_12345.hdf");
    for (const std::size_t index : {0, 9999, 10'000}) CHECK(is_series_member(series_member("run", index), "run"));
    for (const char* name : {"run_001.hdf", "run_0001.hdf.tmp.1", "run0001.hdf", "run_00a1.hdf", "../run_0001.hdf",
                             "run_0001_0001.hdf", "sun_0001.hdf", "run_0001/.hdf", "run_.hdf", ".hdf", ""}) {
        CAPTURE(name);
        CHECK(!is_series_member(name, "run"));
    }
}
