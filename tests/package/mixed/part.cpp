/// \file One of two files of a program, compiled with other options than the other one (see run.sh). PART is its name,
/// OTHER that of the other file.
#include <firn/firn.hpp>

#include <bit>
#include <cstdint>
#include <cstdio>

#define JOINED(a, b) a##b
#define NAME(a, b) JOINED(a, b)

std::uint64_t NAME(run_of_, PART)() {
    firn::Simulation<2> simulation({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 16});
    simulation.add(firn::sample_box<2>({0.4, 0.05}, {0.6, 0.25}, {.spacing = 1.0 / 32}), 1000.0, {1.0, -0.7});
    for (int k = 0; k < 100; ++k) simulation.step();
    std::uint64_t hash = 0;
    for (std::size_t slot = 0; slot < simulation.particles().slots(); ++slot)
        if (simulation.particles().is_particle(slot))
            hash += (2 * simulation.particles().id(slot) + 1) *
                    std::bit_cast<std::uint32_t>(simulation.particles().velocity(slot)[1]);
    return hash;
}

void NAME(mistake_of_, PART)() { firn::Simulation<2>({.lower = {0, 0}, .upper = {1, 1}, .cell_size = -1}); }

#ifdef ALONE
int main() { std::printf("%016llx\n", static_cast<unsigned long long>(NAME(run_of_, PART)())); }
#endif

#ifdef OTHER
std::uint64_t NAME(run_of_, OTHER)();
void NAME(mistake_of_, OTHER)();

int main() {
    std::printf("%016llx ", static_cast<unsigned long long>(NAME(run_of_, PART)()));
    std::printf("%016llx\n", static_cast<unsigned long long>(NAME(run_of_, OTHER)()));
    try {
        NAME(mistake_of_, OTHER)();
    } catch (const firn::parameter_error&) {
        return 0;
    } catch (...) {
        std::puts("A file does not catch what a file of another build throws.");
    }
    return 1;
}
#endif
