/// \file What states cost a run: the same steps without states and with one every so many, turn by turn in one program.
///
///     firn_output_cost [PARTICLES] [STEPS] [TURNS] [FOLDER]
///
/// A line for each interval: the ratios of the median times, by the clock and by the processors (of all threads: what
/// other programs take from them is not in it).
#include <firn/io/states.hpp>

#include "scene.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

double median(std::vector<double> times) {
    std::sort(times.begin(), times.end());
    return times.size() % 2 ? times[times.size() / 2] : (times[times.size() / 2 - 1] + times[times.size() / 2]) / 2;
}

}  // namespace

int main(int count, char** words) {
    const output::Words word{count, words};
    const int steps = std::atoi(word(2, "200")), turns = std::atoi(word(3, "5"));
    auto simulation = output::blocks(std::atof(word(1, "1e6")), 0);
    const std::filesystem::path folder = word(4, "output_cost");
    for (int i = 0; i < 20; ++i) simulation.step();
    // Every turn does the same steps again.
    const auto begin = firn::state_of(simulation);

    const std::vector<int> intervals{0, 100, 10};  // steps a state; 0: none
    std::vector<std::vector<double>> times(intervals.size()), of_processors(intervals.size());
    firn::BackgroundSeries<float> series(folder, "cost");
    for (int turn = 0; turn <= turns; ++turn)
        for (std::size_t k = 0; k < intervals.size(); ++k) {
            firn::restore(simulation, begin);
            const double start = output::now();
            const std::clock_t ticks = std::clock();
            for (int i = 1; i <= steps; ++i) {
                simulation.step();
                if (intervals[k] == 0 || i % intervals[k] != intervals[k] / 2) continue;
                auto state = series.spare();
                firn::state_of(simulation, state);
                series.write(std::move(state));
            }
            // States lie in the middle of their intervals, so that what a state takes falls on steps; what is left to
            // be written when they are done would have taken its time from further steps.
            series.finish();
            if (turn == 0) continue;  // fetches memory
            times[k].push_back(output::now() - start);
            of_processors[k].push_back(double(std::clock() - ticks) / CLOCKS_PER_SEC);
        }
    std::printf("%zu particles, %d steps, %d turns\n", begin.size(), steps, turns);
    for (std::size_t k = 0; k < intervals.size(); ++k) {
        const double time = median(times[k]), work = median(of_processors[k]);
        if (intervals[k] == 0)
            std::printf("no states:                %6.2f s, processors %6.2f s\n", time, work);
        else
            std::printf("a state every %3d steps:  %6.2f s, processors %6.2f s: ratios %.3f, %.3f\n", intervals[k],
                        time, work, time / median(times[0]), work / median(of_processors[0]));
    }
    std::filesystem::remove_all(folder);
}
