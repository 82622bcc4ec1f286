//! # Speed
//!
//! This page tells you what to set, how to measure, and what to expect.
//!
//! ## What to set
//!
//! | | |
//! | --- | --- |
//! | optimisation | `-O3`, or `CMAKE_BUILD_TYPE=Release`; without it, programs are some hundred times slower |
//! | processor | `-march=native`: SIMD lanes are then as wide as the registers |
//! | threads | one for each core, by `OMP_NUM_THREADS` or `firn::Coloured{.threads = 8}` |
//! | places | `OMP_PLACES=cores OMP_PROC_BIND=close`, if no other program runs on a machine with several processors |
//! | precision | `float`; `double` takes about twice the time |
//! | stiffness | E as small as the scene allows; with four times the E, a run has twice as many steps. For stiff matter that moves slowly: [implicit steps](19_implicit_steps.cpp) |
//! | transfer | firn::Apic; firn::Flip, firn::Aflip and firn::Asflip take a second P2G in each step |
//! | execution | firn::Coloured; firn::FixedPoint is for comparison with GPUs |
//!
//! ## How to measure
//!
//! Count particle-steps a second. Take some steps to warm up first, and then time steps that include sorting. If other
//! programs run beside yours, measure the processor time. To compare two settings, run them in turns within one run,
//! because the clock of a processor changes.
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
    //! On a Xeon at 2.1 GHz with AVX-512, two elastic cubes of 144,054 particles make 29 million particle-steps a
    //! second on one thread, and 55 million on two. On one thread, this is seventeen times as fast as straightforward
    //! Eigen code on the same scene. A particle takes 185 bytes. Memory and time depend on the matter, not on the size
    //! of the domain. Spray costs more: with 11 particles in a block of 4³ cells, a particle takes three to four times
    //! as long. `benchmarks/README.md` has all tables.
    //!
    //! ## How long it takes to compile
    //!
    //! A compiler needs about six times as long for a simulation as for one `JacobiSVD` of Eigen. The common
    //! simulations (`Simulation<2>` and `Simulation<3>`, with their samples and states) are also in a library. Your
    //! project compiles this library once, with its own options:
    //!
    //! ```cmake
    //! add_compile_options(-march=native)                            # of the program and the library alike
    //! find_package(firn REQUIRED COMPONENTS hdf5 compiled)          # or add_subdirectory(firn)
    //! target_link_libraries(simulator PRIVATE firn::compiled_hdf5)  # firn::compiled, without states
    //! ```
    //!
    //! For any other simulation, declare it in a header and compile it in one source file of your program:
    //!
    //! ```cpp
    //! extern template class firn::Simulation<3, firn::Snow<float>>;  // in your header
    //! template class firn::Simulation<3, firn::Snow<float>>;         // in one source file
    //! ```
    //!
    //! ## Options that a program must not mix
    //!
    //! firn does not compile with `-ffast-math`, `-Ofast` and the parts of `-funsafe-math-optimizations`, with which sums,
    //! sines and powers would be wrong. `-fno-math-errno` and `-ffp-contract` are free to choose.
    //!
    //! Two files of a program may have different options, for example one for old processors and one with `-march=native`.
    //! Each then has firn's code and bits as if it were alone: compilers and linkers show the build in firn's names, as in
    //! `firn::v3_omp_g12::Simulation`. If one file calls a function of the other with firn's types, both need the same
    //! processor, OpenMP, compiler, and both optimisation or none; else the linker reports an undefined reference. Only
    //! exceptions pass between builds. Choose between such files at run time, with functions that have no type of firn's
    //! in their parameters. What no macro tells is not seen: give `-mtune`, `-ffp-contract`, and either `-O1` or `-O2` and
    //! more, to all files alike.
    //!
    //! ## Threads
    //!
    //! firn's loops run on OpenMP's threads. The results have the same bits on any number of threads. firn calls your
    //! functions of a particle or a node (loads, fields, boundaries) on several threads at once. Your functions that
    //! firn calls once a step may open parallel regions. If your program calls firn inside a parallel region, or in a
    //! child of `fork()`, firn runs on the calling thread only. Your program can also lend its own threads to firn,
    //! with firn::LentThreads: see `examples/14_lend_threads.cpp`.
    return speed > 0 ? 0 : 1;
}
