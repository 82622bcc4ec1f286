/// \file Defines the command line with CLI11, which takes long to compile: once for all examples.
#include "options.hpp"

#include <firn/core/error.hpp>

#include <CLI/CLI.hpp>

#include <charconv>
#include <cmath>
#include <thread>

namespace example {

namespace {

/// Lets an option have only numbers from `least` to `most`.
template <class T>
void check(CLI::Option& option, const char* type, const char* kind, T least, T most) {
    const auto problem = [=](std::string& given) -> std::string {
        T number{};
        const auto* end = given.data() + given.size();
        const auto [stop, error] = std::from_chars(given.data(), end, number);
        // A NaN fails both comparisons.
        if (error == std::errc{} && stop == end && number >= least && number <= most) return {};
        return firn::sentence('\'', given, "' cannot be used; give ", kind, " from ", least, " to ", most, '.');
    };
    option.type_name(type)->check(CLI::Validator(problem, ""));
}

}  // namespace

CommandLine::CommandLine(Defaults defaults)
    : defaults_(std::move(defaults)),
      particles_(defaults_.particles),
      steps_(defaults_.steps),
      frames_(defaults_.frames),
      output_(defaults_.output),
      app_(std::make_unique<CLI::App>(defaults_.about, defaults_.name)) {
    CLI::App& app = *app_;
    app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    add("--particles", particles_, "Number of particles", 1, most_particles);
    add("--steps", steps_, "Number of time steps", 0, most_steps);
    add("--frames", frames_,
        defaults_.takes_time
            ? "States to write after the initial one; without --steps or --time, the run ends with the last"
            : "States to write after the initial one; without --steps, the run ends with the last",
        0, most_frames);
    if (defaults_.takes_time) add("--time", time_, "Simulated seconds, in place of --steps", 0.0, 1e6);
    add("--threads", threads_, "Number of threads; 0 means all", 0, most_threads);
    app.add_option("--output", output_, "Folder for states and pictures; created if missing")
        ->type_name("DIR")
        ->capture_default_str()
        ->check(CLI::Validator(
            [](std::string& given) { return given.empty() ? std::string("give the name of a folder.") : ""; }, ""));
    if (defaults_.writes_obj) {
        app.add_flag("--obj", obj_, "Write every state as an OBJ file, too, for Houdini and Blender");
        app.add_flag("--ply", ply_, "Write every state as a PLY file, too: positions, velocities, masses, ids");
    }
    app.add_flag("--pictures", pictures_, "Draw a picture of every state: NAME_0000.png and so on");
    app.add_flag("--film", film_, "Draw these pictures, and make a film of them with ffmpeg: NAME.mp4");
    if (defaults_.can_go_on) {
        auto* go_on = app.add_flag("--go-on", go_on_, "Go on from the last states in that folder");
        add("--restart", restart_, "States to go on from: of this build and run, of another build, of any run",
            restarts());
        app.get_option("--restart")->needs(go_on);
    }
}

CommandLine::~CommandLine() = default;

void CommandLine::add(const std::string& flag, std::int64_t& value, const std::string& about, std::int64_t least,
                      std::int64_t most) {
    check(*app_->add_option(flag, value, about)->capture_default_str(), "N", "a whole number", least, most);
}

void CommandLine::add(const std::string& flag, double& value, const std::string& about, double least, double most) {
    check(*app_->add_option(flag, value, about)->capture_default_str(), "X", "a number", least, most);
}

void CommandLine::add(const std::string& flag, std::optional<double>& value, const std::string& about, double least,
                      double most) {
    const auto store = [&value](double given) { value = given; };
    check(*app_->add_option_function<double>(flag, store, about), "X", "a number", least, most);
}

void CommandLine::add(const std::string& flag, std::string& value, const std::string& about,
                      const std::vector<std::string>& words) {
    std::string list;
    for (const auto& word : words) list += (list.empty() ? "" : word == words.back() ? " or " : ", ") + word;
    const auto problem = [=](std::string& given) -> std::string {
        if (std::find(words.begin(), words.end(), given) != words.end()) return {};
        return firn::sentence('\'', given, "' cannot be used; give ", list, '.');
    };
    app_->add_option(flag, value, about + " (" + list + ")")
        ->type_name("WORD")
        ->capture_default_str()
        ->check(CLI::Validator(problem, ""));
}

void CommandLine::add_file(const std::string& flag, std::string& value, const std::string& about,
                           const std::string& kind) {
    app_->add_option(flag, value, about)->type_name(kind)->capture_default_str();
}

bool CommandLine::is_given(const std::string& flag) const { return app_->count(flag) > 0; }

std::optional<int> CommandLine::parse(int argc, const char* const* argv) {
    try {
        app_->parse(argc, argv);
        if (time_ && is_given("--steps"))
            throw CLI::ValidationError("--time and --steps", "each says when the run ends; give one of the two.");
    } catch (const CLI::ParseError& problem) {
        const int code = app_->exit(problem);
        return problem.get_exit_code() == 0 ? 0 : std::max(code, 1);
    }
    const auto given = [&](const char* flag, auto value) {
        return is_given(flag) ? std::optional(value) : std::nullopt;
    };
    const auto all = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    options_ = {defaults_.name,
                particles_,
                schedule(defaults_.steps, defaults_.frames, given("--steps", steps_), given("--frames", frames_)),
                threads_ == 0 ? all : static_cast<int>(threads_),
                std::filesystem::path(output_),
                go_on_,
                obj_,
                ply_,
                pictures_ || film_,
                film_,
                restart_,
                time_,
                frames_};
    return std::nullopt;
}

Schedule Options::schedule_of_time(double now, std::int64_t done, double length) const {
    // A time that is reached but for rounding errors takes no further step.
    const double steps = std::max(0.0, std::ceil((time.value() - now) / length - 1e-6));
    if (!(double(done) + steps <= double(CommandLine::most_steps))) {
        throw firn::parameter_error(firn::sentence("To last ", *time, " s, the run would take ", steps, " steps of ",
                                                   length, " s; at most ", CommandLine::most_steps,
                                                   " are allowed. Give a shorter --time."));
    }
    return spread(done + std::int64_t(steps), frames);
}

}  // namespace example
