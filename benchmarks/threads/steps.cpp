/// \file threads_steps SCENE THREADS HOSTS SECONDS step|advance: threads of the host's, each with a simulation of the
/// two cubes (SCENE: 144k or 8k) on so many threads, side by side for so long. Prints millions of particle-steps a
/// second, of each host.
#include "../scenes.hpp"

#include <barrier>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>
#include <thread>

int main(int count, char** arguments) {
    if (count != 6) {
        std::cerr << "threads_steps 144k|8k THREADS HOSTS SECONDS step|advance\n";
        return 2;
    }
    const std::size_t particles = std::strcmp(arguments[1], "8k") == 0 ? 8000 : 144'054;
    const int threads = std::atoi(arguments[2]), hosts = std::atoi(arguments[3]);
    const double seconds = std::atof(arguments[4]);
    const bool advances = std::strcmp(arguments[5], "advance") == 0;
    const auto scene = scenes::two_cubes<3>(particles);
    const auto make = [&] {
        auto simulation = std::make_unique<firn::Simulation<3>>(
            scene.domain, firn::FixedCorotated<float>::from_young_poisson(scene.young, scene.poisson),
            firn::Coloured{threads});
        add(*simulation, scene);
        for (int i = 0; i < scene.steps.before; ++i) simulation->step();
        return simulation;
    };

    std::barrier together(hosts);
    std::vector<double> rates(std::size_t(hosts), 0.0);
    const auto measure = [&](int host) {
        auto simulation = make();
        scenes::Stopwatch watch;
        std::uint64_t steps = 0;
        together.arrive_and_wait();
        while (watch.seconds() < seconds) {
            if (simulation->steps() >= std::uint64_t(scene.steps.all)) simulation = make();
            const std::uint64_t before = simulation->steps();
            watch.run([&] {
                if (advances) return simulation->advance(10 * scene.time_step);
                for (int i = 0; i < 10; ++i) simulation->step();
            });
            steps += simulation->steps() - before;
        }
        rates[std::size_t(host)] = double(steps) * double(scene.size()) / watch.seconds() / 1e6;
    };
    std::vector<std::jthread> others;
    for (int host = 1; host < hosts; ++host) others.emplace_back(measure, host);
    measure(0);
    others.clear();
    for (const double rate : rates) std::cout << rate << '\n';
}
