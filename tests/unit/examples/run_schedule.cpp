/// \file The course of an example's run: a step that fails leaves the states before it, and says which is the last.
#include "../../../examples/support/run_schedule.hpp"

#include "support/catch.hpp"
#include "support/temporary_folder.hpp"

#include <sstream>

namespace {

struct Course {
    std::vector<std::string> calls;
    std::string said;

    /// \param failing  the step that throws, from 1; \param finishes  or finish() throws, too
    Course(const std::filesystem::path& folder, int failing, bool finishes, const example::Begun& begun = {}) {
        example::Options options;
        options.name = "course";
        options.output = folder;
        options.schedule = {10, {3, 6, 10}};
        std::ostringstream text;
        std::streambuf* const out = std::cout.rdbuf(text.rdbuf());
        std::streambuf* const err = std::cerr.rdbuf(text.rdbuf());
        try {
            int step = int(begun.steps);
            example::run_schedule(
                options, 1, begun, [&] { calls.push_back("write"); },
                [&] {
                    calls.push_back("finish");
                    if (!finishes) throw firn::io_error("the disk is full");
                },
                [&] {
                    if (++step == failing) throw firn::particle_error("particle 7");
                },
                [] { return example::Image(1, 1); }, {folder / "course.hdf.series"});
        } catch (const firn::particle_error& problem) {
            calls.push_back(problem.what());
        }
        std::cout.rdbuf(out);
        std::cerr.rdbuf(err);
        said = text.str();
    }
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
