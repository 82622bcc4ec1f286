//! # Many machines
//!
//! With MPI a simulation runs on many processes (*ranks*), on one machine or on many. Each rank computes the particles
//! of a part of space, and the parts follow the matter. A rank may have several threads.
//!
//! **The bits of a run depend neither on the number of ranks nor on the number of threads.** They are those of a run
//! without MPI. So a scene that works on a laptop is the same scene on a cluster.
//!
//! ![A dam breaks over houses. Water of one colour is computed by one of four ranks: examples/18_many_machines](../images/many_machines.webp)
//!
//! ## What a program changes
//!
//! | without MPI | on many ranks |
//! | --- | --- |
//! | `#include <firn/firn.hpp>` | `#include <firn/mpi.hpp>` as well |
//! | | `firn::mpi::Session session(argc, argv);` at the beginning of `main` |
//! | `firn::Simulation simulation(box, sand, walls);` | `firn::Simulation simulation(box, sand, walls, firn::mpi::Distributed<firn::Coloured>{});` |
//! | `firn::StateSeries series("out", "slope");` | `firn::mpi::StateSeries series(ranks, "out", "slope");` |
//! | `firn::read_state<float>(file)` | `firn::mpi::read_state<float>(ranks, file)` |
//! | `firn::restore(simulation, …)` | `firn::mpi::restore(simulation, …)` |
//! | `interruption.requested()` | `simulation.execution.interrupted()` |
//! | `std::printf(…)` | `if (ranks.rank() == 0) std::printf(…)` |
//!
//! In CMake link `firn::mpi`, of the component `mpi` of `find_package(firn)`; `pkg-config` has `firn-mpi`. firn needs
//! MPI 3.1, such as Open MPI or MPICH, and for states HDF5:
//!
//! ```cmake
//! find_package(firn REQUIRED COMPONENTS hdf5 mpi)
//! target_link_libraries(simulator PRIVATE firn::mpi firn::hdf5)
//! ```
#include <firn/firn.hpp>
#include <firn/mpi.hpp>
#include <firn/mpi/states.hpp>

#include <cstdio>

//! ## The program
//!
//! Every rank runs the whole program, and makes the same calls in the same order: each function of a simulation is
//! *collective*, as MPI calls it. A rank that leaves out a call, or takes another branch, lets the others wait for
//! ever. What all ranks get alike (time, totals, reactions, `interrupted()`) may decide on a branch; what a rank finds
//! among its own particles may not, until `sum()` or `max()` of its firn::mpi::Communicator has told it to all.
template <class Execution>
auto scene(const Execution& execution) {
    const firn::Domain<2> box{.lower = {0, 0}, .upper = {2, 1}, .cell_size = 1.0 / 48};
    firn::Simulation simulation(box, firn::Sand<float>::from_properties({.young = 1e6}), execution);
    simulation.add(firn::sample_box<2>({0.0, 0.0}, {0.4, 0.7}, {.spacing = 1.0 / 96}), 1600);
    simulation.reactions.emplace();
    return simulation;
}

int main(int argc, char** argv) {
    firn::mpi::Session session(argc, argv);  // starts MPI; its destructor ends it
    const firn::mpi::Communicator ranks;     // rank(), size(), sum(), max(), …

    auto simulation = scene(firn::mpi::Distributed<firn::Coloured>({.threads = 1}, ranks));
    firn::mpi::StateSeries series(ranks, "out", "slope");
    const firn::Interruption interruption;  // SIGTERM on any rank ends the loop on all of them, after the same step
    for (int frame = 0; frame < 3 && !simulation.execution.interrupted(); ++frame) {
        simulation.advance(0.05);
        series.write(firn::state_of(simulation));
    }

    //! ## What is equal to the bit
    //!
    //! - every field of every particle, with its id; also when particles are added, removed, or die
    //! - `totals()` and `reactions`, which firn sums exactly
    //! - the size of every time step, warnings, and errors
    //! - states: the files have the same bytes; compressed ones the same fields and digests
    //!
    //! Not equal: which particles a rank has and in which slots they lie, and what your program sums in floating-point
    //! numbers over its own particles. Use one binary on all machines: code for other processors rounds differently.
    auto alone = scene(firn::Coloured{.threads = 1});  // the same run without MPI, on each rank
    for (int frame = 0; frame < 3; ++frame) alone.advance(0.05);
    const auto of_all = simulation.totals(), of_one = alone.totals();
    const bool same = of_all.momentum == of_one.momentum && of_all.kinetic_energy == of_one.kinetic_energy;
    const auto here = std::uint64_t(simulation.particles().size()), most = ranks.max(here), all = ranks.sum(here);
    if (ranks.rank() == 0)
        std::printf("%llu particles on %d ranks, at most %llu on one; the bits of a run without MPI: %s\n",
                    static_cast<unsigned long long>(all), ranks.size(), static_cast<unsigned long long>(most),
                    same ? "yes" : "no");
    //! ## Ranks, threads and binding
    //!
    //! ```bash
    //! mpirun -n 4 ./slope                   # four ranks on this machine; ./slope alone is one rank
    //! ```
    //!
    //! Ranks and threads both use the cores, and give the same bits. Begin with one rank for each NUMA domain (often a
    //! socket), and a thread for each of its cores: few ranks exchange little, and the memory of a rank is near its
    //! cores. Say how many threads a rank has, by `OMP_NUM_THREADS` or by `Coloured{.threads = 16}`: if each of four
    //! ranks took all cores, they would be in each other's way. And bind the ranks, or the system moves them about:
    //!
    //! | MPI | two sockets of 32 cores a machine: two ranks of 32 threads each |
    //! | --- | --- |
    //! | Open MPI | `mpirun --map-by ppr:1:socket:pe=32 --bind-to core -x OMP_NUM_THREADS=32 ./slope` |
    //! | MPICH | `mpiexec -ppn 2 -bind-to socket -genv OMP_NUM_THREADS 32 ./slope` |
    //! | Slurm | `srun --ntasks-per-node=2 --cpus-per-task=32 --cpu-bind=cores ./slope` |
    //!
    //! Add `OMP_PLACES=cores OMP_PROC_BIND=close`. `mpirun --report-bindings` prints where ranks are. Measure before a
    //! long run: `mpirun -n 1`, `2`, `4` … for a hundred steps of your scene.
    //!
    //! firn calls MPI on the thread that calls the simulation, and on no other (MPI_THREAD_FUNNELED).
    //!
    //! ## A job
    //!
    //! For Slurm, on eight machines with two sockets of 32 cores. Five minutes before the time is over, Slurm sends
    //! SIGTERM to all ranks. They end the loop and write the last state, and the next job goes on from it, on as many
    //! machines as it gets:
    //!
    //! ```bash
    //! #!/bin/bash
    //! #SBATCH --job-name=slope
    //! #SBATCH --nodes=8
    //! #SBATCH --ntasks-per-node=2
    //! #SBATCH --cpus-per-task=32
    //! #SBATCH --time=12:00:00
    //! #SBATCH --signal=TERM@300
    //!
    //! export OMP_NUM_THREADS=$SLURM_CPUS_PER_TASK OMP_PLACES=cores OMP_PROC_BIND=close OMP_WAIT_POLICY=passive
    //! cd "$SCRATCH/slope"            # a parallel file system that all machines see
    //! srun --cpus-per-task=$SLURM_CPUS_PER_TASK --cpu-bind=cores ./slope
    //! ```
    //!
    //! Open MPI's `mpirun` kills its ranks about two seconds after Ctrl-C, which may be too short for the last state.
    //! A SIGTERM to any one of the ranks (`pkill -TERM -n slope`) stops all of them after the same step, in peace.
    //!
    //! ## Files
    //!
    //! All ranks write one file together, each its part. `firn::mpi::StateSeries` writes under a temporary name, syncs,
    //! and then gives the file its name, as without MPI: what has a name is whole. The run waits meanwhile. HDF5 need
    //! not be its parallel build.
    //!
    //! A state tells neither how many ranks wrote it nor where cuts lay. A run goes on from it on any number of ranks,
    //! or without MPI, to the same bits:
    //!
    //! ```cpp
    //! firn::mpi::restore(simulation, firn::mpi::read_state<float>(ranks, "out/slope_0002.hdf"));
    //! ```
    //!
    //! The folder must be on a file system that all machines see, and whose files several machines can write at the
    //! same time: Lustre, BeeGFS, GPFS, not NFS and not a machine's own `/tmp`. On Lustre, spread the files over
    //! several servers before the first is written: `lfs setstripe -c 8 -S 4M out`. A program may write to other files
    //! as well; write those on rank 0 alone.
    //!
    //! ## Big runs
    //!
    //! - **Adding matter.** Where every rank gives `add` the same samples, each keeps its share; but all samples of this
    //!   body, 24 bytes each, are in memory on every rank while `add` runs. For a body that is too large for that, each
    //!   rank gives firn::mpi::add only some of the samples. The body is then those of rank 0, those of rank 1, and so
    //!   on. For the same bits on any number of ranks, cut the body into slabs whose number does not depend on it:
    //!
    //!   ```cpp
    //!   constexpr int slabs = 4096;
    //!   firn::Samples<3> mine;
    //!   for (int slab = slabs * ranks.rank() / ranks.size(); slab < slabs * (ranks.rank() + 1) / ranks.size(); ++slab) {
    //!       const auto of_slab = firn::sample_box<3>(lower_corner(slab), upper_corner(slab), {.spacing = spacing});
    //!       mine.volume = of_slab.volume;
    //!       mine.positions.insert(mine.positions.end(), of_slab.positions.begin(), of_slab.positions.end());
    //!   }
    //!   firn::mpi::add(simulation, mine, 1600);
    //!   ```
    //!
    //! - **Memory.** A rank needs memory for its particles (some 200 bytes each), for their nodes, and for messages. It
    //!   does not grow with the domain, nor with the particles of others. The first step takes more, since most
    //!   particles then move to other ranks: plan 700 bytes for a particle, or add matter where it will be computed.
    //! - **Balance.** When a rank has more than 1.1 times the mean number of particles, space is divided anew:
    //!   `execution.largest_imbalance`. Some ranks may have no particles at all. `execution.migrations()` counts how
    //!   often that was done.
    //! - **States.** A whole state is about as large as the memory of the particles. Write those rarely, and selected
    //!   fields often: `StateOptions::fields` and `complete_every`. Do not compress them: one rank would do it for all.
    //!
    //! ## What it costs
    //!
    //! In each step a rank sends the sums at nodes that it shares with its neighbours, and gets them back complete. On
    //! 1,000 ranks of a million particles each, eight in a cell, these are 1.0 to 1.8 MB a rank and step, and 2.9 MB at
    //! most, to 27 neighbours. All ranks join in one reduction a step. When particles are sorted, those that have left
    //! the part of their rank are sent after it.
    //!
    //! A model of the cost, from these counts and from times of single steps, expects 10⁹ particles to keep 94 % of the
    //! ideal speed on 64 cores, 87 % on 1,024, and 81 % on 4,096, where each has 250,000 particles. Below 100,000
    //! particles a core, more cores gain little. `benchmarks/README.md` has the counts, the model, and what it leaves
    //! out. Nothing of this size has run yet.
    //!
    //! ## Failures
    //!
    //! | what happens | how the run ends |
    //! | --- | --- |
    //! | an exception leaves `main` on one rank | its text is printed once, `firn: rank 2 of 4: …`, and all ranks end |
    //! | a particle cannot be computed | all ranks throw the same error, which names rank, particle and cause |
    //! | a rank crashes or is killed | MPI ends the others, and its message names the signal |
    //! | SIGINT or SIGTERM on any rank | `interrupted()` is true on all ranks after the same step |
    //! | MPI itself fails | MPI's message, and all ranks end |
    //!
    //! In each case the job has ended within two seconds in our tests, with an exit code that is not 0. Do not catch an
    //! exception on one rank to go on without the others: call `firn::mpi::Session::fail(text)` instead. The last state
    //! is whole, as without MPI.
    //!
    //! ## What is refused
    //!
    //! - nets and other forces between particles; a firn::ParticleSystem runs on one rank
    //! - programs for a GPU, and WebAssembly
    //!
    //! `examples/18_many_machines.cpp` is a whole program, with options and pictures.
    return same ? 0 : 1;
}
