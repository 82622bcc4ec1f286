/// \file What states cost a run: the same steps without states and with one every so many, turn by turn in one program.
///
///     firn_output_cost [PARTICLES] [STEPS] [TURNS] [FOLDER]
///
/// A line for each interval: the ratio of the median times, and what a state costs.
#include <firn/io/states.hpp>

#include "scene.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace {

double median(std::vector<double> times) {
    std::sort(times.begin(), times.end());
    return times.size() % 2 ? times[times.size() / 2] : (times[times.size() / 2 - 1] + times[times.size() / 2]) / 2;
}

}  // namespace

int main(int count, char** words) {
    const auto word = [&](int i, const char* otherwise) { return count > i ? words[i] : otherwise; };
    const int steps = std::atoi(word(2, "200")), turns = std::atoi(word(3, "5"));
    auto simulation = output::blocks(std::atof(word(1, "1e6")), 0);
    const std::filesystem::path folder = word(4, "output_cost");
    const auto now = [] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    };
    for (int i = 0; i < 20; ++i) simulation.step();
    // Every turn does the same steps again.
    const auto begin = firn::state_of(simulation);

    const std::vector<int> intervals{0, 100, 10};  // steps a state; 0: none
    std::vector<std::vector<double>> times(intervals.size());
    for (int turn = 0; turn <= turns; ++turn)
        for (std::size_t k = 0; k < intervals.size(); ++k) {
            firn::restore(simulation, begin);
            firn::BackgroundSeries<float> series(folder, "cost");
            double seconds = -now();
            for (int i = 1; i <= steps; ++i) {
                simulation.step();
                if (intervals[k] == 0 || i % intervals[k] != 0) continue;
                auto state = series.spare();
                firn::state_of(simulation, state);
                series.write(std::move(state));
            }
            // What is still being written when the steps are done would take its time from further steps.
            series.finish();
            seconds += now();
            if (turn > 0) times[k].push_back(seconds);  // the first turn fetches memory
        }
    const double without = median(times[0]);
    std::printf("%zu particles, %d steps, %d turns: %.2f s without states\n", begin.size(), steps, turns, without);
    for (std::size_t k = 1; k < intervals.size(); ++k) {
        const double with = median(times[k]);
        std::printf("a state every %3d steps: %.2f s, ratio %.3f, %.0f ms a state\n", intervals[k], with,
                    with / without, 1000 * (with - without) * intervals[k] / steps);
    }
    std::filesystem::remove_all(folder);
}
