/// \file The command-line options of every example, and the steps after which a run writes states.
///
///     example::CommandLine line({.name = "two_cubes", .about = "One cube falls on the other.",
///                                .particles = 144'054, .steps = 4'000, .frames = 100});
///     double young = 1e3;
///     line.add("--young", young, "Young's modulus in Pa", 1.0, 1e9);
///     if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
///     const example::Options& options = line.options();
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

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

    explicit CommandLine(Defaults defaults);
    ~CommandLine();
    CommandLine(const CommandLine&) = delete;
    CommandLine& operator=(const CommandLine&) = delete;

    /// Adds an option of an example: an integer from `least` to `most`.
    void add(const std::string& flag, std::int64_t& value, const std::string& about, std::int64_t least,
             std::int64_t most);
    /// Adds an option of an example: a number from `least` to `most`.
    void add(const std::string& flag, double& value, const std::string& about, double least, double most);
    /// Adds an option of an example that need not have a value: a number from `least` to `most`.
    void add(const std::string& flag, std::optional<double>& value, const std::string& about, double least,
             double most);
    /// Adds an option of an example: one of several words.
    void add(const std::string& flag, std::string& value, const std::string& about,
             const std::vector<std::string>& words);
    /// Adds an option of an example: the name of a file such as "FILE.obj".
    void add_file(const std::string& flag, std::string& value, const std::string& about, const std::string& kind);

    /// Reads the arguments. Returns an exit code if the program must end: 0 after --help, another after an error, which
    /// it prints to standard error.
    [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv);

    [[nodiscard]] const Options& options() const { return options_; }
    /// Whether an option such as "--particles" was among the arguments.
    [[nodiscard]] bool is_given(const std::string& flag) const;

private:
    Defaults defaults_;
    std::int64_t particles_, steps_, frames_;
    std::int64_t threads_ = 0;
    std::string output_;
    std::string restart_ = restarts()[0];
    std::optional<double> time_;
    bool go_on_ = false, obj_ = false, ply_ = false, pictures_ = false, film_ = false;
    Options options_;
    std::unique_ptr<CLI::App> app_;  // incomplete here: the library takes long to compile
};

}  // namespace example
