/// \file The course of an example's run: a step that fails leaves the states before it, and says which is the last.
#include "../../../examples/support/run_schedule.hpp"

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

#include <csignal>
#include <sstream>
#include <utility>

namespace {

struct Course {
    std::vector<std::string> calls;
    std::string said;
    example::Outcome outcome;
    int drawn = 0;

    static example::Options options_in(const std::filesystem::path& folder) {
        example::Options options;
        options.name = "course";
        options.output = folder;
        options.schedule = {10, {3, 6, 10}};
        return options;
    }
    /// \param failing  the step that throws, from 1; \param finishes  or finish() throws, too
    Course(const std::filesystem::path& folder, int failing, bool finishes, const example::Begun& begun = {})
        : Course(
              options_in(folder),
              [failing](int step) {
                  if (step == failing) throw firn::particle_error("particle 7");
              },
              finishes, begun) {}
    template <class Step>
    Course(const example::Options& options, const Step& make_step, bool finishes = true,
           const example::Begun& begun = {}) {
        std::ostringstream text;
        std::streambuf* const out = std::cout.rdbuf(text.rdbuf());
        std::streambuf* const err = std::cerr.rdbuf(text.rdbuf());
        try {
            int step = int(begun.steps);
            outcome = example::run_schedule(
                options, [] { return 1; }, begun, [&] { calls.push_back("write"); },
                [&] {
                    calls.push_back("finish");
                    if (!finishes) throw firn::io_error("the disk is full");
                },
                [&] { make_step(++step); },
                [&] {
                    ++drawn;
                    return example::Image(1, 1);
                },
                {options.file(".hdf.series")});
        } catch (const firn::particle_error& problem) {
            calls.push_back(problem.what());
        }
        std::cout.rdbuf(out);
        std::cerr.rdbuf(err);
        said = text.str();
    }
    [[nodiscard]] bool says(const std::string& text) const { return said.find(text) != std::string::npos; }
};

}  // namespace

TEST_CASE("a step that throws: states are finished, the last is named, the error goes on", "[examples]") {
    const TemporaryFolder folder;
    const Course course(folder.path(), 8, true);
    CHECK(course.calls == std::vector<std::string>{"write", "write", "write", "finish", "particle 7"});
    CHECK(course.said.find((folder.path() / "course_0002.hdf").string()) != std::string::npos);
}

TEST_CASE("a run that goes on writes no state at its start, and counts on", "[examples]") {
    const TemporaryFolder folder;
    const Course whole(folder.path(), 11, true, {5, 2});  // after step 5, with two states in the series
    CHECK(whole.calls == std::vector<std::string>{"write", "write", "finish"});
    CHECK(whole.said.find("4 states") != std::string::npos);
    const Course failing(folder.path(), 8, true, {5, 2});
    CHECK(failing.calls == std::vector<std::string>{"write", "finish", "particle 7"});
    CHECK(failing.said.find((folder.path() / "course_0002.hdf").string()) != std::string::npos);
}

TEST_CASE("where the states cannot be finished that is said, and the step's error goes on", "[examples]") {
    const TemporaryFolder folder;
    const Course course(folder.path(), 1, false);
    CHECK(course.calls == std::vector<std::string>{"write", "finish", "particle 7"});
    CHECK(course.said.find("the disk is full") != std::string::npos);
}

TEST_CASE("a whole run ends with 0; a run that goes on has its earlier steps, but they are no work", "[examples]") {
    const TemporaryFolder folder;
    const Course whole(folder.path(), 11, true, {5, 2});
    CHECK(whole.outcome.done == 10);
    CHECK(whole.outcome.exit_code() == 0);
    CHECK(whole.outcome.part().empty());
    // 5 steps of a particle: were the other 5 counted as done at once, the first line would be of step 5 of 10.
    CHECK_FALSE(whole.says("step 5 of 10"));
    CHECK(whole.says("step 6 of 10"));
}

TEST_CASE("where a run is finished, going on makes no step and says so", "[examples]") {
    const TemporaryFolder folder;
    for (const std::int64_t begun : {10, 12}) {
        const Course course(folder.path(), 1, true, {begun, 4});
        CHECK(course.calls == std::vector<std::string>{"finish"});
        CHECK(course.says("the " + std::to_string(begun) + " steps of the run are done: there is nothing left to do"));
        CHECK_FALSE(course.says("particle-steps"));
        CHECK(course.outcome.has_moved());
        CHECK(course.outcome.part().empty());
        CHECK(course.outcome.exit_code() == 0);
    }
}

TEST_CASE("a run of no steps says that nothing moves", "[examples]") {
    const TemporaryFolder folder;
    auto options = Course::options_in(folder.path());
    options.schedule = {0, {}};
    const Course course(options, [](int) { throw firn::particle_error("a step"); });
    CHECK(course.calls == std::vector<std::string>{"write", "finish"});
    CHECK(course.says("nothing moves in 0 steps"));
    CHECK_FALSE(course.outcome.has_moved());
    CHECK(course.outcome.exit_code() == 0);
}

TEST_CASE("Ctrl-C ends a run after the step, with a state; results say of which part; the exit code tells",
          "[examples]") {
    const TemporaryFolder folder;
    for (const auto& [signal, code] : {std::pair(SIGINT, 130), std::pair(SIGTERM, 143)}) {
        const Course course(Course::options_in(folder.path()), [raised = signal](int step) {
            if (step == 4) std::raise(raised);
        });
        CHECK(course.calls == std::vector<std::string>{"write", "write", "write", "finish"});
        CHECK(course.says("interrupted after 4 steps"));
        CHECK(course.outcome.is_interrupted());
        CHECK(course.outcome.exit_code() == code);
        CHECK(course.outcome.part() == "after 4 of 10 steps: ");
    }
    int steps = 0;
    std::ostringstream text;
    std::streambuf* const out = std::cout.rdbuf(text.rdbuf());
    const example::Outcome second = example::run_steps(10, 1, [&] {
        if (++steps == 7) std::raise(SIGINT);
    });
    std::cout.rdbuf(out);
    CHECK(steps == 7);
    CHECK(second.exit_code() == 130);
    CHECK(text.str().find("interrupted after 7 steps") != std::string::npos);
}

TEST_CASE("on request there is a picture of each state, after an interruption and a restart, too", "[examples]") {
    const auto pictures = [](const TemporaryFolder& folder) {
        std::string found;
        for (int k = 0; k < 9; ++k)
            if (std::filesystem::exists(folder.path() / ("course" + example::numbered(k, ".png"))))
                found += std::to_string(k);
        return found;
    };
    const TemporaryFolder folder;
    auto options = Course::options_in(folder.path());
    const Course none(options, [](int) {});
    CHECK(pictures(folder).empty());
    CHECK(none.drawn == 1);  // course.png
    options.pictures = true;
    const Course all(options, [](int) {});
    CHECK(pictures(folder) == "0123");
    CHECK(all.drawn == 4);  // the last is course.png, too

    const TemporaryFolder other;
    options.output = other.path();
    const Course stopped(options, [](int step) {
        if (step == 4) std::raise(SIGINT);
    });
    CHECK(pictures(other) == "012");
    std::filesystem::remove(other.path() / "course_0002.png");
    const Course rest(options, [](int) {}, true, {4, 3});
    CHECK(pictures(other) == "01234");  // the picture of the state that it goes on from was missing
}

TEST_CASE("a film's command holds any path, and a film needs pictures", "[examples]") {
    const std::string command = example::film_command("/a b/it's 50%/course", 3, 40);
    CHECK(command.find("-start_number 3 -i 'file:/a b/it'\\''s 50%%/course_%04d.png' -frames:v 40") !=
          std::string::npos);
    CHECK(command.find("'file:/a b/it'\\''s 50%/course.mp4'") != std::string::npos);
    CHECK(example::pictures_per_second(3) == 10);
    CHECK(example::pictures_per_second(100) == 20);
    CHECK(example::pictures_per_second(1000) == 30);

    const TemporaryFolder folder;
    std::ostringstream text;
    std::streambuf* const err = std::cerr.rdbuf(text.rdbuf());
    CHECK_FALSE(example::make_film(folder.path() / "course", 3));
    std::cerr.rdbuf(err);
    CHECK(text.str().find("there are no pictures") != std::string::npos);
}
