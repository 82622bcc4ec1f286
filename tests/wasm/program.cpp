// The program of module.mjs: the runs of support/golden.hpp, and what ends a module.
#include "support/golden.hpp"

#include "runtime.hpp"

#include <array>
#include <atomic>
#include <limits>
#include <memory>
#include <new>
#include <vector>

namespace {

constexpr firn::Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 16};
const firn::FixedCorotated<float> jelly = firn::FixedCorotated<float>::from_young_poisson(1e5, 0.3);
using Simulation = firn::Simulation<3, firn::FixedCorotated<float>, firn::Apic, firn::MlsForce>;

/// Calls f(worker) many times, on two threads at the same time if there are two.
template <class F>
void on_two_threads(const F& f) {
    std::atomic<bool> is_helped = firn::thread_count(0) == 1;
    const double end = firn::detail::seconds_now() + 10;
    firn::parallel_for(100, 2, [&](std::size_t, int worker) {
        if (worker == 1) is_helped = true;
        while (!is_helped && firn::detail::seconds_now() < end) {
        }
        f(worker);
    });
}

int made = 0;  // how many Slow variables have been made
struct Slow {
    Slow() {
        for (const double end = firn::detail::seconds_now() + 0.1; firn::detail::seconds_now() < end;) {
        }
        ++made;
    }
};

}  // namespace

WASM_EXPORT(mpm) std::uint64_t mpm(int threads) { return golden::coloured_3d(threads); }
WASM_EXPORT(mpm_stored) std::uint64_t mpm_stored() { return golden::of_coloured_3d; }
WASM_EXPORT(points) std::uint64_t points(int threads) { return golden::points_3d(threads); }
WASM_EXPORT(points_stored) std::uint64_t points_stored() { return golden::of_points_3d; }

WASM_EXPORT(threads_of_loops) int threads_of_loops() { return firn::thread_count(0); }
/// How many chunks of a loop the second thread runs.
WASM_EXPORT(chunks_of_helper) int chunks_of_helper() {
    std::atomic<int> count = 0;
    on_two_threads([&](int worker) { count += worker; });
    return count;
}
/// Both threads allocate, write, read and free; returns how many blocks have changed in between.
WASM_EXPORT(spoilt_blocks) int spoilt_blocks() {
    std::atomic<int> spoilt = 0;
    on_two_threads([&](int worker) {
        for (std::size_t i = 0; i < 500; ++i) {
            const std::size_t mine = 2 * i + std::size_t(worker);
            std::array<std::unique_ptr<std::vector<std::size_t>>, 8> blocks;
            for (std::size_t k = 0; k < 8; ++k)
                blocks[k] = std::make_unique<std::vector<std::size_t>>(1 + (i + k) % 50, mine);
            for (const auto& block : blocks)
                for (const std::size_t number : *block) spoilt += number != mine;
        }
    });
    return spoilt;
}
/// How often a variable is made that two threads want at the same time.
WASM_EXPORT(made_once) int made_once() {
    made = 0;
    on_two_threads([](int) { static const Slow slow; });
    return made;
}

WASM_EXPORT(bad_cell_size) void bad_cell_size() {
    firn::Domain<3> domain = box;
    domain.cell_size = -1;
    Simulation simulation(domain, jelly);
}
WASM_EXPORT(bad_particle) void bad_particle() {
    Simulation simulation(box, jelly);
    simulation.add({.positions = {{0.5, 0.5, 0.5}}, .volume = 1e-6}, 1000);
    auto& particles = simulation.edit_particles();
    particles.set_velocity(0, {std::numeric_limits<float>::quiet_NaN(), 0, 0});
    simulation.step();
}
WASM_EXPORT(throw_on_helper) void throw_on_helper() {
    on_two_threads([](int worker) {
        if (worker == 1) throw firn::usage_error("The helper threw this: ν ≥ ½.");
    });
}
WASM_EXPORT(trap_on_helper) void trap_on_helper() {
    on_two_threads([](int worker) {
        if (worker == 1) __builtin_trap();
    });
}
WASM_EXPORT(throw_number) void throw_number() { throw 3; }
WASM_EXPORT(fill_memory) void fill_memory() {
    std::vector<std::unique_ptr<char[]>> all;
    for (;;) all.emplace_back(new char[1 << 20]);
}
WASM_EXPORT(large_grid) void large_grid() { firn::require_memory(1e12, "This grid", "Choose larger cells."); }
WASM_EXPORT(overflow_stack) int overflow_stack(int depth) {
    volatile char room[1000];
    room[depth % 1000] = 1;
    return depth == 0 ? 0 : overflow_stack(depth - 1) + room[0];
}

WASM_EXPORT(write_lines) void write_lines() {
    std::fputs("first ", stdout);
    std::fputs("line\nsecond", stdout);
    std::fputs(" line\n", stdout);
    std::fflush(stdout);
}
WASM_EXPORT(sum) double sum(const float* numbers, int count) {
    double all = 0;
    for (int i = 0; i < count; ++i) all += double(numbers[i]);
    return all;
}
WASM_EXPORT(greeting) const char* greeting() { return "grüß dich"; }
/// The address of new numbers 0, 1, 2, …
WASM_EXPORT(numbers) const float* numbers(int count) {
    static std::vector<float> kept;
    kept.resize(std::size_t(count));
    for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = float(i);
    return kept.data();
}
