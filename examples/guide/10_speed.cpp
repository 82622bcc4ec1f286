//! # Speed
//!
//! What to set, what to expect, how to measure.
//!
//! ## What to set
//!
//! | | |
//! | --- | --- |
//! | optimisation | `-O3`, or `CMAKE_BUILD_TYPE=Release`; without, some hundred times slower |
//! | processor | `-march=native`: lanes are as wide as the target's registers |
//! | threads | one for each core: `OMP_NUM_THREADS`, or `firn::Coloured{.threads = 8}` |
//! | places | alone on a machine with several processors: `OMP_PLACES=cores OMP_PROC_BIND=close` |
//! | precision | `float`; `double` takes about twice the time |
//! | stiffness | a step is bounded by the time that sound takes to cross a cell: E four times as large, twice the steps |
//! | transfer | firn::Apic; firn::Flip and its kin take a second P2G each step |
//! | execution | firn::Coloured; firn::FixedPoint is for comparison with GPUs |
//!
//! ## How to measure
//!
//! Count particle-steps a second, over steps that include sorting, after some steps to warm up. Time in the processor's
//! seconds where other programs run beside yours. Compare two settings by turns in one run: clocks change.
#include <firn/firn.hpp>

#include <chrono>
#include <cstdio>

int main() {
    const firn::Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 64};
    firn::Simulation<3> simulation(box, firn::FixedCorotated<float>::from_young_poisson(1e5, 0.3));
    simulation.add(firn::sample_box<3>({0.1, 0.3, 0.3}, {0.4, 0.6, 0.6}, {.spacing = 1.0 / 128}), 1000,
                   {1.0, 0.0, 0.0});

    for (int i = 0; i < 20; ++i) simulation.step();
    const auto start = std::chrono::steady_clock::now();
    const int steps = 50;
    for (int i = 0; i < steps; ++i) simulation.step();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const double speed = double(simulation.particles().size()) * steps / seconds;
    std::printf("%zu particles, %.1f million particle-steps a second\n", simulation.particles().size(), speed / 1e6);

    //! ## What to expect
    //!
    //! On two cores of a Xeon at 2.1 GHz with AVX-512, two elastic cubes of 144,054 particles make 29 million
    //! particle-steps a second on one thread and 55 on two: seventeen times straightforward Eigen code on the same
    //! scene. A particle takes 185 bytes. Memory and time are those of the matter, not of the domain. Spray costs more:
    //! with 11 particles a block of 4³ cells three to four times as much a particle. `benchmarks/README.md` has all
    //! tables.
    //!
    //! ## How long it takes to compile
    //!
    //! A simulation takes a compiler about six times what one `JacobiSVD` of Eigen's takes. The common ones
    //! (`Simulation<2>`, `Simulation<3>`, their samples and states) are also in a library that your project compiles
    //! once, with its own options:
    //!
    //! ```cmake
    //! add_compile_options(-march=native)                            # of the program and the library alike
    //! find_package(firn REQUIRED COMPONENTS hdf5 compiled)          # or add_subdirectory(firn)
    //! target_link_libraries(simulator PRIVATE firn::compiled_hdf5)  # firn::compiled, without states
    //! ```
    //!
    //! Any other simulation can be left to one file of your program:
    //!
    //! ```cpp
    //! extern template class firn::Simulation<3, firn::Snow<float>>;  // in your header
    //! template class firn::Simulation<3, firn::Snow<float>>;         // in one source file
    //! ```
    //!
    //! ## Threads
    //!
    //! Loops run on OpenMP's threads, with the same bits on any number of them. Functions of yours that are called for
    //! every particle or node (loads, fields, boundaries) run on several threads at once; those called once a step may
    //! open parallel regions of their own. Inside a parallel region of yours, and in a child of `fork()`, firn runs on
    //! the calling thread. A host's own threads are lent through firn::LentThreads: `examples/14_lend_threads.cpp`.
    return speed > 0 ? 0 : 1;
}
