/// \file A host program lends its threads to firn, here std::jthreads that are new for every step.
#include <firn/firn.hpp>

#include <atomic>
#include <iostream>
#include <system_error>
#include <thread>
#include <vector>

namespace {

std::atomic<int> lent = 0;

/// A game would give copies of `work` to its job system. A job may begin at any time, even after the step has ended;
/// the caller does the work that no job has taken.
void lend_jthreads(int workers, const firn::Work& work) {
    std::vector<std::jthread> helpers;
    try {
        for (int k = 1; k < workers; ++k) {
            helpers.emplace_back(work, k);
            ++lent;
        }
    } catch (const std::system_error&) {
        // The system has no more threads. Fewer are enough.
    }
    work(0);
}

/// Returns the kinetic energy [J] of a jelly cube after 0.05 s.
double run() {
    const firn::Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64};
    const auto jelly = firn::FixedCorotated<float>::from_young_poisson(5e4, 0.3);  // Pa
    firn::Simulation<3> simulation(box, jelly, firn::Coloured{.threads = 3});
    const auto cube = firn::sample_box<3>({0.3, 0.1, 0.3}, {0.6, 0.4, 0.6}, {.spacing = 1.0 / 128});
    simulation.add(cube, 1000.0, {1.0, -2.0, 0.5});
    simulation.advance(0.05);  // s
    return simulation.totals().kinetic_energy;
}

}  // namespace

int main() {
    const double alone = run();  // on OpenMP's threads
    const firn::LentThreads threads(lend_jthreads);
    const double together = run();
    std::cout << "kinetic energy " << together << " J, with " << lent << " threads lent for one step each\n";
    return alone == together && lent > 0 ? 0 : 1;  // the same bits on any threads
}
