/// \file The options that examples share: which steps are written, and what is refused.
#include "../../../examples/support/options.hpp"

#include "support/catch.hpp"

#include "../../../examples/support/progress.hpp"

#include <chrono>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Steps = std::vector<std::int64_t>;

/// Standard output and error of a few lines, kept away from the terminal.
class Quiet {
public:
    Quiet() : out_(std::cout.rdbuf(text_.rdbuf())), err_(std::cerr.rdbuf(text_.rdbuf())) {}
    ~Quiet() {
        std::cout.rdbuf(out_);
        std::cerr.rdbuf(err_);
    }
    [[nodiscard]] std::string text() const { return text_.str(); }

private:
    std::ostringstream text_;
    std::streambuf* out_;
    std::streambuf* err_;
};

struct Parsed {
    std::optional<int> exit_code;
    example::Options options;
    double young;
    std::string said;
};

Parsed parse(std::vector<const char*> arguments) {
    arguments.insert(arguments.begin(), "falling");
    example::CommandLine line(
        {.name = "falling", .about = "Something falls.", .particles = 800, .steps = 1000, .frames = 50});
    double young = 1e3;
    line.add("--young", young, "Young's modulus in Pa", 1.0, 1e9);
    const Quiet quiet;
    const auto exit_code = line.parse(static_cast<int>(arguments.size()), arguments.data());
    return {exit_code, line.options(), young, quiet.text()};
}

}  // namespace

TEST_CASE("states are spread evenly over the steps and the last follows the last step", "[examples]") {
    // By hand.
    CHECK(example::spread(10, 5).write_after == Steps{2, 4, 6, 8, 10});
    CHECK(example::spread(10, 3).write_after == Steps{3, 6, 10});
    CHECK(example::spread(7, 2).write_after == Steps{3, 7});
    CHECK(example::spread(4, 1).write_after == Steps{4});

    SECTION("more frames than steps: one after each step") {
        CHECK(example::spread(3, 10).write_after == Steps{1, 2, 3});
    }
    SECTION("no frames: the last step is written all the same") {
        CHECK(example::spread(5, 0).write_after == Steps{5});
    }
    SECTION("no steps: the initial state is the last one") {
        CHECK(example::spread(0, 5).write_after.empty());
        CHECK(example::spread(0, 0).write_after.empty());
    }
    SECTION("the largest numbers allowed do not overflow and do not repeat a step") {
        const auto schedule = example::spread(example::CommandLine::most_steps, example::CommandLine::most_frames);
        CHECK(schedule.write_after.size() == std::size_t(example::CommandLine::most_frames));
        CHECK(schedule.write_after.front() == 1000);
        CHECK(schedule.write_after.back() == 100'000'000);
    }
    SECTION("a step is asked about by its number") {
        const auto schedule = example::spread(10, 3);
        CHECK(schedule.writes_after(3));
        CHECK_FALSE(schedule.writes_after(4));
        CHECK_FALSE(schedule.writes_after(0));
        CHECK(schedule.writes_after(10));
    }
}

TEST_CASE("what is asked for sets the length and the cadence of a run", "[examples]") {
    // By hand, for a default of 100 steps and 10 frames: one state every 10 steps.
    const auto of = [](std::optional<std::int64_t> steps, std::optional<std::int64_t> frames) {
        return example::schedule(100, 10, steps, frames);
    };
    const std::optional<std::int64_t> none;

    CHECK(of(none, none).steps == 100);
    CHECK(of(none, none).write_after == Steps{10, 20, 30, 40, 50, 60, 70, 80, 90, 100});

    SECTION("frames only: the same cadence, cut short or carried on") {
        CHECK(of(none, 3).steps == 30);
        CHECK(of(none, 3).write_after == Steps{10, 20, 30});
        CHECK(of(none, 12).steps == 120);
        CHECK(of(none, 0).steps == 0);
        CHECK(of(none, 0).write_after.empty());
        // A cadence that is not whole: the default run writes after 3, 6 and 10 of 10 steps.
        CHECK(example::schedule(10, 3, none, 2).write_after == Steps{3, 6});
        CHECK(example::schedule(10, 3, none, 2).steps == 6);
    }
    SECTION("steps only: the default number of frames, where there are so many steps") {
        CHECK(of(20, none).write_after == Steps{2, 4, 6, 8, 10, 12, 14, 16, 18, 20});
        CHECK(of(4, none).write_after == Steps{1, 2, 3, 4});
        CHECK(of(0, none).write_after.empty());
    }
    SECTION("both: the steps, spread over the frames") {
        CHECK(of(9, 3).steps == 9);
        CHECK(of(9, 3).write_after == Steps{3, 6, 9});
        CHECK(of(2, 5).write_after == Steps{1, 2});
        CHECK(of(7, 0).write_after == Steps{7});
    }
    SECTION("a default of no steps or no frames is no division by zero") {
        CHECK(example::schedule(0, 0, none, 4).steps == 0);
        CHECK(example::schedule(6, 0, none, 2).write_after == Steps{6, 12});
    }
}

TEST_CASE("an example takes the common options and its own", "[examples]") {
    const auto plain = parse({});
    REQUIRE_FALSE(plain.exit_code.has_value());
    CHECK(plain.options.particles == 800);
    CHECK(plain.options.schedule.steps == 1000);
    CHECK(plain.options.schedule.write_after.size() == 50);
    CHECK(plain.options.threads >= 1);
    CHECK(plain.options.file("_0000.hdf") == std::filesystem::path("out") / "falling_0000.hdf");

    const auto given = parse({"--particles", "5000", "--steps=30", "--frames", "3", "--threads", "2", "--output",
                              "elsewhere", "--young", "2e3"});
    REQUIRE_FALSE(given.exit_code.has_value());
    CHECK(given.options.particles == 5000);
    CHECK(given.options.schedule.write_after == Steps{10, 20, 30});
    CHECK(given.options.threads == 2);
    CHECK(given.options.output == "elsewhere");
    CHECK(given.young == 2000.0);

    const auto shorter = parse({"--frames", "5"});
    CHECK(shorter.options.schedule.steps == 100);

    CHECK_FALSE(plain.options.pictures);
    CHECK(parse({"--pictures"}).options.pictures);
    CHECK_FALSE(parse({"--pictures"}).options.film);
    CHECK(parse({"--film"}).options.pictures);  // of which it is made
    CHECK(parse({"--film"}).options.film);
}

TEST_CASE("help ends the program well, and names every option with its default", "[examples]") {
    const auto help = parse({"--help"});
    REQUIRE(help.exit_code == 0);
    for (const char* text : {"Something falls.", "--particles", "800", "--steps", "1000", "--frames", "--threads",
                             "--output", "--young"}) {
        CAPTURE(text);
        CHECK(help.said.find(text) != std::string::npos);
    }
}

TEST_CASE("an option that cannot be used ends the program with a sentence that names it", "[examples]") {
    const auto refused = [](const char* option, const char* value) {
        const auto parsed = parse({option, value});
        INFO(option << " " << value << ": " << parsed.said);
        REQUIRE(parsed.exit_code.has_value());
        CHECK(*parsed.exit_code != 0);
        CHECK(parsed.said.find(option) != std::string::npos);
        return parsed.said;
    };
    CHECK(refused("--steps", "-3").find("'-3' cannot be used; give a whole number from 0 to 100000000.") !=
          std::string::npos);
    refused("--particles", "0");
    refused("--particles", "many");
    refused("--particles", "1.5");
    refused("--particles", "99999999999999999999");
    refused("--frames", "100001");
    refused("--threads", "-1");
    refused("--output", "");
    refused("--young", "0");
    refused("--young", "nan");
    refused("--young", "inf");
    refused("--speed", "3");
    CHECK(parse({"--steps"}).exit_code.value_or(0) != 0);
}

TEST_CASE("away from a terminal, progress is at most a line for each tenth", "[examples]") {
    const auto lines = [](std::int64_t steps, std::int64_t stride) {
        std::ostringstream out;
        example::Progress progress(steps, 1000, out, false);
        for (std::int64_t k = 0; k < steps; k += stride) progress.advance(stride);
        std::vector<std::string> result;
        std::istringstream in(out.str());
        for (std::string text; std::getline(in, text);) result.push_back(text);
        return result;
    };
    const auto all = lines(1000, 1);
    REQUIRE(all.size() == 10);
    CHECK(all[1].find("step 200 of 1000, ") == 0);
    CHECK(all[1].find(" particle-steps/s") != std::string::npos);
    CHECK(lines(7, 1).size() == 7);
    CHECK(lines(13, 5).back().find("step 13 of 13, ") == 0);  // the last stride goes past the end
    CHECK(lines(0, 1).empty());
}

TEST_CASE("steps before a restart are no work of this run", "[examples]") {
    std::ostringstream out;
    example::Progress progress(1000, 1'000'000'000'000, out, false);
    progress.skip(990);
    CHECK(out.str().empty());
    progress.leave_out(std::chrono::milliseconds(-100));  // as if 0.1 s had passed
    progress.advance(10, 1);
    // 10 particle-steps in 0.1 s and little more. The bound leaves room for a slow machine.
    std::istringstream rate(out.str().substr(out.str().find(", ") + 2));
    double number = 0;
    std::string unit;
    rate >> number >> unit;
    CHECK(number <= 100);
    CHECK(number > 0);
    CHECK(unit == "particle-steps/s");

    std::ostringstream done;
    example::Progress finished(1000, 1, done, false);
    finished.skip(2000);
    finished.advance();
    CHECK(done.str().empty());
}

TEST_CASE("on a terminal, progress is a bar that is full at the end, for any number of steps", "[examples]") {
    // Boost.Timer's bar has 51 stars between its ends.
    for (const std::int64_t steps : {1, 7, 50, 51, 333}) {
        std::ostringstream out;
        example::Progress progress(steps, 1000, out, true);
        for (std::int64_t k = 0; k < steps; ++k) progress.advance();
        progress.advance(5);
        const auto text = out.str();
        CAPTURE(steps, text);
        CHECK(std::count(text.begin(), text.end(), '*') == 51);
        CHECK(text.find("particle-steps/s") != std::string::npos);
    }
}

TEST_CASE("rates are short", "[examples]") {
    CHECK(example::readable(3.14e6) == "3.1 M");
    CHECK(example::readable(31.4e6) == "31 M");
    CHECK(example::readable(512e3) == "512 k");
    CHECK(example::readable(999'900.0) == "1.0 M");
    CHECK(example::readable(87.0) == "87");
}
