/// \file Runs any example's steps, with states by the schedule, a progress bar and a picture.
#pragma once

#include "support/errors.hpp"
#include "support/film.hpp"
#include "support/options.hpp"
#include "support/png.hpp"
#include "support/progress.hpp"
#include "support/renderer.hpp"
#include <firn/io/interruption.hpp>
#include <firn/io/series_file.hpp>
#include <firn/io/state_parts.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

namespace example {

/// Numbers in the renderer's palette.
enum Colour : std::uint8_t { coral, teal, amber, indigo, moss, plum, slate, sand, snow };

/// Waits for the states of a run that ended with an error, and prints the names of the last ones.
template <class Finish>
void say_last_states(int states, const Finish& finish, const std::vector<std::filesystem::path>& series) {
    std::cerr << std::endl;  // ends the line of the progress bar
    try {
        finish();
    } catch (const std::exception& problem) {
        std::cerr << "the last states may be missing: " << problem.what() << std::endl;
        return;
    }
    const std::string number = numbered(states - 1, ".hdf");
    std::cerr << "the last good state:";
    for (const auto& list : series) {  // NAME.hdf.series
        const std::string name = list.string();
        std::cerr << ' ' << name.substr(0, name.size() - std::string(".hdf.series").size()) << number;
    }
    std::cerr << std::endl;
}

/// Returns the states of a series.
/// \throws firn::io_error  if there are none
inline std::vector<firn::SeriesEntry> states_to_go_on_from(const std::filesystem::path& series) {
    auto states = firn::read_series(series);
    if (states.empty()) throw firn::io_error(firn::sentence("There is no state in ", series, " to go on from."));
    return states;
}

/// Calls restore(how) with the states that --restart accepts.
/// \throws firn::io_error  as restore(), with the option that its advice means
template <class Restore>
void restore_as(const Options& options, const Restore& restore) {
    const auto& names = restarts();
    try {
        restore(firn::Restart(std::find(names.begin(), names.end(), options.restart) - names.begin()));
    } catch (const firn::io_error& problem) {
        const std::string what = problem.what(), advice = "Restart::";
        const auto at = what.find(advice);
        if (at == std::string::npos) throw;
        const auto name = at + advice.size();
        throw firn::io_error(what + " Here that is --restart " + what.substr(name, what.find('.', name) - name) + ".");
    }
}

/// The part of a run that was done before a restart.
struct Begun {
    std::int64_t steps = 0;
    int states = 0;  ///< in its series
};

/// How far a run has come.
struct Outcome {
    std::int64_t done = 0;  ///< steps, with those before a restart
    std::int64_t planned = 0;
    int signal = 0;           ///< SIGINT (Ctrl-C) or SIGTERM if it has ended the run, else 0
    bool film_fails = false;  ///< whether ffmpeg has failed to make a film

    [[nodiscard]] bool has_moved() const { return done > 0; }
    [[nodiscard]] bool is_interrupted() const { return signal != 0; }
    /// For main(): 0, 1 without the film that was asked for, 130 after Ctrl-C, 143 after SIGTERM.
    [[nodiscard]] int exit_code() const { return signal != 0 ? 128 + signal : film_fails ? 1 : 0; }
    /// To print before results: "" for a whole run, else "after 40 of 1600 steps: ".
    [[nodiscard]] std::string part() const {
        if (done >= planned) return {};
        return "after " + std::to_string(done) + " of " + std::to_string(planned) + " steps: ";
    }
};

/// Makes `planned` steps with a progress bar. Ctrl-C (or SIGTERM) ends them after a step, and prints so.
template <class Step>
Outcome run_steps(std::int64_t planned, std::int64_t particles, const Step& step) {
    const firn::Interruption interruption;
    Progress progress(planned, particles);
    Outcome outcome{0, planned};
    while (outcome.done < planned && !interruption.requested()) {
        step();
        ++outcome.done;
        progress.advance();
    }
    outcome.signal = interruption.signal();
    if (outcome.is_interrupted()) std::cout << "\ninterrupted after " << outcome.done << " steps" << std::endl;
    return outcome;
}

/// Runs the schedule, or the rest of it. It writes states before the first step and by the schedule, and a picture at
/// the end; with --pictures one of every state, with --film a film of them. Ctrl-C (or SIGTERM) ends the run early,
/// with a state and a picture. If a step throws, the earlier states are finished, and the name of the last one is
/// printed.
/// \param particles  returns their number, which may change
/// \param begun      the part that was done before a restart
/// \param write      writes a state
/// \param finish     returns when all states are on disk
/// \param step       makes a step
/// \param picture    draws the picture of a state
/// \param series     the lists of the states, which ParaView opens
/// \param signal_of  signal_of(interruption) returns the signal that ends the run, 0 if none; on several ranks, which
///                   must agree, something else than the default. Then ranks without a picture return an empty one.
template <class Particles, class Write, class Finish, class Step, class Picture>
Outcome run_schedule(const Options& options, const Particles& particles, const Begun& begun, const Write& write,
                     const Finish& finish, const Step& step, const Picture& picture,
                     const std::vector<std::filesystem::path>& series,
                     const std::function<int(const firn::Interruption&)>& signal_of = &firn::Interruption::signal) {
    Outcome outcome{begun.steps, options.schedule.steps};
    const auto at_first = particles();
    std::cout << options.name << ": " << (at_first > 0 ? std::to_string(at_first) : "no") << " particles"
              << (at_first > 0 ? ", " : " yet, ") << outcome.planned << " steps, " << options.threads
              << (options.threads == 1 ? " thread" : " threads") << std::endl;
    const bool films =
        options.film && finds_ffmpeg(options.file(""), 1 + std::int64_t(options.schedule.write_after.size()));

    std::optional<Progress> progress;
    Image last;  // the picture of the last state
    int states = begun.states;
    const auto save = [&](const std::string& ending) {
        if (!last.pixels.empty()) write_png(options.file(ending), last);
    };
    const auto draw = [&](int state) {
        const auto start = std::chrono::steady_clock::now();
        last = picture();
        save(numbered(state, ".png"));
        if (progress) progress->leave_out(std::chrono::steady_clock::now() - start);
    };
    const auto write_one = [&] {
        write();
        if (options.pictures) draw(states);
        ++states;
    };
    if (states == 0)
        write_one();
    else if (options.pictures && !std::filesystem::exists(options.file(numbered(states - 1, ".png"))))
        draw(states - 1);
    if (outcome.planned == 0 && begun.steps == 0)
        std::cout << "nothing moves in 0 steps: the state and the picture show the beginning" << std::endl;
    else if (begun.steps >= outcome.planned)
        std::cout << "the " << begun.steps << " steps of the run are done: there is nothing left to do" << std::endl;
    else if (begun.states > 0)
        std::cout << "going on after step " << begun.steps << std::endl;

    const firn::Interruption interruption;
    progress.emplace(outcome.planned, 0);
    progress->skip(begun.steps);
    while (outcome.done < outcome.planned && !outcome.is_interrupted()) {
        const std::int64_t now = particles();
        try {
            step();
        } catch (...) {
            say_last_states(states, finish, series);
            throw;
        }
        ++outcome.done;
        outcome.signal = signal_of(interruption);
        if (outcome.is_interrupted() || options.schedule.writes_after(outcome.done)) write_one();
        progress->advance(1, now);
        if (outcome.is_interrupted()) std::cout << "\ninterrupted after " << outcome.done << " steps" << std::endl;
    }
    finish();
    if (last.pixels.empty()) last = picture();
    save(".png");
    std::cout << states << (states == 1 ? " state" : " states");
    for (const auto& file : series) std::cout << (&file == series.data() ? ": " : ", ") << file.string();
    std::cout << "\npicture: " << options.file(".png").string() << std::endl;
    if (options.pictures)
        std::cout << "of every state: " << options.file(numbered(0, ".png")).string() << " …" << std::endl;
    if (films) outcome.film_fails = !make_film(options.file(""), states);
    return outcome;
}

}  // namespace example
