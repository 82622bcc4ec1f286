/// \file The command-line options of every example, and the steps after which a run writes states.
///
///     example::CommandLine line({.name = "two_cubes", .about = "One cube falls on the other.",
///                                .particles = 144'054, .steps = 4'000, .frames = 100});
///     double young = 1e3;
///     line.add("--young", young, "Young's modulus in Pa", 1.0, 1e9);
///     if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
///     const example::Options& options = line.options();
#pragma once

#include <firn/core/error.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace example {

/// The number of steps of a run, and the steps after which it writes a state. It also writes the initial state, which
/// is not listed.
struct Schedule {
    std::int64_t steps = 0;
    std::vector<std::int64_t> write_after;  ///< ascending; the last is `steps`; empty without steps

    [[nodiscard]] bool writes_after(std::int64_t step) const {
        return std::binary_search(write_after.begin(), write_after.end(), step);
    }
};

/// Spreads `frames` states evenly over the steps: state k after step ⌊k steps / frames⌋. It writes at most one state
/// per step, and always one after the last step.
inline Schedule spread(std::int64_t steps, std::int64_t frames) {
    Schedule schedule{steps, {}};
    frames = std::clamp<std::int64_t>(frames, std::min<std::int64_t>(steps, 1), steps);
    for (std::int64_t k = 1; k <= frames; ++k) schedule.write_after.push_back(k * steps / frames);
    return schedule;
}

/// Returns the schedule for the given options. With steps, the frames, or the default number of them, are spread over
/// the steps. With frames only, the run has the spacing of the default run, and ends after so many frames. With
/// neither, it is the default run.
inline Schedule schedule(std::int64_t default_steps, std::int64_t default_frames, std::optional<std::int64_t> steps,
                         std::optional<std::int64_t> frames) {
    if (steps || !frames) return spread(steps.value_or(default_steps), frames.value_or(default_frames));
    const std::int64_t per = std::clamp<std::int64_t>(default_frames, 1, std::max<std::int64_t>(default_steps, 1));
    Schedule result;
    for (std::int64_t k = 1; k <= *frames && default_steps > 0; ++k) {
        result.write_after.push_back(k * default_steps / per);
    }
    if (!result.write_after.empty()) result.steps = result.write_after.back();
    return result;
}

/// Default values of an example's options.
struct Defaults {
    std::string name;   ///< NAME in its files NAME_0000.hdf, NAME.png
    std::string about;  ///< one sentence for --help
    std::int64_t particles = 100'000;
    std::int64_t steps = 1'000;
    std::int64_t frames = 50;
    std::string output = "out";
    bool can_go_on = false;   ///< whether its states have all that the run needs to go on
    bool writes_obj = true;   ///< as OBJ and as PLY files
    bool takes_time = false;  ///< whether --time can say when the run ends; its time step must be fixed
};

/// How a run goes on from a state: the values of firn::Restart, by name.
inline const std::vector<std::string>& restarts() {
    static const std::vector<std::string> names{"same_bits", "other_build", "converted"};
    return names;
}

struct Options {
    std::string name;
    std::int64_t particles = 0;
    Schedule schedule;
    int threads = 1;  ///< number of threads, never 0
    std::filesystem::path output;
    bool go_on = false;                 ///< whether to go on from the last states in `output`
    bool obj = false;                   ///< whether to write every state as an OBJ file, too
    bool ply = false;                   ///< whether to write every state as a PLY file, too
    bool pictures = false;              ///< whether to draw a picture of every state
    bool film = false;                  ///< whether to make a film of them; then `pictures` is set, too
    std::string restart = "same_bits";  ///< which states a run goes on from: one of restarts()
    std::optional<double> time{};       ///< simulated seconds, which then say when the run ends, not `schedule`
    std::int64_t frames = 0;            ///< states to spread over that time

    /// Returns the schedule of a run that is to last until `time`. The last step is the first to reach it.
    /// \param now     the time after the steps that are done [s]
    /// \param done    number of these steps
    /// \param length  time step [s]
    /// \throws firn::parameter_error  if that takes too many steps
    [[nodiscard]] Schedule schedule_of_time(double now, std::int64_t done, double length) const;

    /// OUTPUT/NAME + ending: `file(".png")`.
    [[nodiscard]] std::filesystem::path file(const std::string& ending) const { return output / (name + ending); }
};

class CommandLine {
public:
    static constexpr std::int64_t most_particles = 200'000'000;
    static constexpr std::int64_t most_steps = 100'000'000;
    static constexpr std::int64_t most_frames = 100'000;
    static constexpr std::int64_t most_threads = 1024;

    explicit CommandLine(Defaults defaults)
        : defaults_(std::move(defaults)),
          particles_(defaults_.particles),
          steps_(defaults_.steps),
          frames_(defaults_.frames),
          output_(defaults_.output),
          app_(defaults_.about, defaults_.name) {
        app_.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
        add("--particles", particles_, "Number of particles", 1, most_particles);
        steps_option_ = add("--steps", steps_, "Number of time steps", 0, most_steps);
        frames_option_ =
            add("--frames", frames_,
                defaults_.takes_time
                    ? "States to write after the initial one; without --steps or --time, the run ends with the last"
                    : "States to write after the initial one; without --steps, the run ends with the last",
                0, most_frames);
        if (defaults_.takes_time)
            time_option_ = add("--time", time_, "Simulated seconds, in place of --steps", 0.0, 1e6)->default_str("");
        add("--threads", threads_, "Number of threads; 0 means all", 0, most_threads);
        app_.add_option("--output", output_, "Folder for states and pictures; created if missing")
            ->type_name("DIR")
            ->capture_default_str()
            ->check(CLI::Validator(
                [](std::string& given) { return given.empty() ? std::string("give the name of a folder.") : ""; }, ""));
        if (defaults_.writes_obj) {
            app_.add_flag("--obj", obj_, "Write every state as an OBJ file, too, for Houdini and Blender");
            app_.add_flag("--ply", ply_, "Write every state as a PLY file, too: positions, velocities, masses, ids");
        }
        app_.add_flag("--pictures", pictures_, "Draw a picture of every state: NAME_0000.png and so on");
        app_.add_flag("--film", film_, "Draw these pictures, and make a film of them with ffmpeg: NAME.mp4");
        if (defaults_.can_go_on) {
            auto* go_on = app_.add_flag("--go-on", go_on_, "Go on from the last states in that folder");
            add("--restart", restart_, "States to go on from: of this build and run, of another build, of any run",
                restarts())
                ->needs(go_on);
        }
    }

    /// Adds an option of an example: an integer from `least` to `most`.
    CLI::Option* add(const std::string& flag, std::int64_t& value, const std::string& about, std::int64_t least,
                     std::int64_t most) {
        return add_checked(flag, value, about, "N", "a whole number", least, most);
    }
    /// Adds an option of an example: a number from `least` to `most`.
    CLI::Option* add(const std::string& flag, double& value, const std::string& about, double least, double most) {
        return add_checked(flag, value, about, "X", "a number", least, most);
    }
    /// Adds an option of an example: one of several words.
    CLI::Option* add(const std::string& flag, std::string& value, const std::string& about,
                     const std::vector<std::string>& words) {
        std::string list;
        for (const auto& word : words) list += (list.empty() ? "" : word == words.back() ? " or " : ", ") + word;
        const auto problem = [=](std::string& given) -> std::string {
            if (std::find(words.begin(), words.end(), given) != words.end()) return {};
            return firn::sentence('\'', given, "' cannot be used; give ", list, '.');
        };
        return app_.add_option(flag, value, about + " (" + list + ")")
            ->type_name("WORD")
            ->capture_default_str()
            ->check(CLI::Validator(problem, ""));
    }
    /// For other options of an example.
    [[nodiscard]] CLI::App& app() { return app_; }

    /// Reads the arguments. Returns an exit code if the program must end: 0 after --help, another after an error, which
    /// it prints to standard error.
    [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv) {
        try {
            app_.parse(argc, argv);
            if (is_given(time_option_) && is_given(steps_option_))
                throw CLI::ValidationError("--time and --steps", "each says when the run ends; give one of the two.");
        } catch (const CLI::ParseError& problem) {
            const int code = app_.exit(problem);
            return problem.get_exit_code() == 0 ? 0 : std::max(code, 1);
        }
        const auto given = [](const CLI::Option* option, auto value) {
            return is_given(option) ? std::optional(value) : std::nullopt;
        };
        const auto all = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
        options_ = {
            defaults_.name,
            particles_,
            schedule(defaults_.steps, defaults_.frames, given(steps_option_, steps_), given(frames_option_, frames_)),
            threads_ == 0 ? all : static_cast<int>(threads_),
            std::filesystem::path(output_),
            go_on_,
            obj_,
            ply_,
            pictures_ || film_,
            film_,
            restart_,
            given(time_option_, time_),
            frames_};
        return std::nullopt;
    }

    [[nodiscard]] const Options& options() const { return options_; }

private:
    static bool is_given(const CLI::Option* option) { return option != nullptr && option->count() > 0; }

    template <class T>
    CLI::Option* add_checked(const std::string& flag, T& value, const std::string& about, const char* type,
                             const char* kind, T least, T most) {
        const auto problem = [=](std::string& given) -> std::string {
            T number{};
            const auto* end = given.data() + given.size();
            const auto [stop, error] = std::from_chars(given.data(), end, number);
            // A NaN fails both comparisons.
            if (error == std::errc{} && stop == end && number >= least && number <= most) return {};
            return firn::sentence('\'', given, "' cannot be used; give ", kind, " from ", least, " to ", most, '.');
        };
        return app_.add_option(flag, value, about)
            ->type_name(type)
            ->capture_default_str()
            ->check(CLI::Validator(problem, ""));
    }

    Defaults defaults_;
    std::int64_t particles_, steps_, frames_;
    std::int64_t threads_ = 0;
    std::string output_;
    std::string restart_ = restarts()[0];
    double time_ = 0.0;
    bool go_on_ = false, obj_ = false, ply_ = false, pictures_ = false, film_ = false;
    CLI::Option* steps_option_ = nullptr;
    CLI::Option* frames_option_ = nullptr;
    CLI::Option* time_option_ = nullptr;
    Options options_;
    CLI::App app_;
};

inline Schedule Options::schedule_of_time(double now, std::int64_t done, double length) const {
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
