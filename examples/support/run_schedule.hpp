/// \file Runs any example's steps, with states by the schedule, a progress bar and a picture.
#pragma once

#include "support/errors.hpp"
#include "support/options.hpp"
#include "support/png.hpp"
#include "support/progress.hpp"
#include "support/renderer.hpp"
#include <firn/io/interruption.hpp>
#include <firn/io/series_file.hpp>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

namespace example {

/// Numbers in the renderer's palette.
enum Colour : std::uint8_t { coral, teal, amber, indigo, moss, plum, slate, sand, snow };

/// Returns "_0012" + ending for the number 12.
inline std::string numbered(int number, const char* ending) {
    char text[24];
    std::snprintf(text, sizeof text, "_%04d", number);
    return std::string(text) + ending;
}

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

/// The part of a run that was done before a restart.
struct Begun {
    std::int64_t steps = 0;
    int states = 0;  ///< in its series
};

/// Runs the schedule, or the rest of it. It writes states before the first step and by the schedule, and a picture at
/// the end. Ctrl-C (or SIGTERM) ends the run early, with a state and a picture. If a step throws, the earlier states
/// are finished, and the name of the last one is printed.
/// \param begun    the part that was done before a restart
/// \param write    writes a state
/// \param finish   returns when all states are on disk
/// \param step     makes a step
/// \param picture  draws the picture at the end
/// \param series   the lists of the states, which ParaView opens
template <class Write, class Finish, class Step, class Picture>
void run_schedule(const Options& options, std::int64_t particles, const Begun& begun, const Write& write,
                  const Finish& finish, const Step& step, const Picture& picture,
                  const std::vector<std::filesystem::path>& series) {
    std::cout << options.name << ": " << particles << " particles, " << options.schedule.steps << " steps, "
              << options.threads << (options.threads == 1 ? " thread" : " threads") << std::endl;
    int states = begun.states;
    const auto write_one = [&] {
        write();
        ++states;
    };
    if (states == 0)
        write_one();
    else
        std::cout << "going on after step " << begun.steps << std::endl;
    const firn::Interruption interruption;
    Progress progress(options.schedule.steps, particles);
    progress.advance(begun.steps);
    for (std::int64_t done = begun.steps + 1; done <= options.schedule.steps; ++done) {
        try {
            step();
        } catch (...) {
            say_last_states(states, finish, series);
            throw;
        }
        const bool is_last = interruption.requested();
        if (is_last || options.schedule.writes_after(done)) write_one();
        progress.advance();
        if (!is_last) continue;
        std::cout << "\ninterrupted after " << done << " steps" << std::endl;
        break;
    }
    finish();
    write_png(options.file(".png"), picture());
    std::cout << states << " states";
    for (const auto& file : series) std::cout << (&file == series.data() ? ": " : ", ") << file.string();
    std::cout << "\npicture: " << options.file(".png").string() << std::endl;
}

}  // namespace example
