//! # States and restart
//!
//! A *state* holds all that a run needs to continue: named arrays with units, in an HDF5 file. firn writes a state
//! under a temporary name, checks it, syncs it to disk, and then gives it its name. So all files are complete, even if
//! the program is killed or the disk is full.
#include <firn/firn.hpp>
#include <firn/io/states.hpp>
#include <firn/io/surface.hpp>
#include <firn/simulation/surface.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>

firn::Simulation<2> scene() {
    firn::Simulation<2> simulation({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 64});
    simulation.add(firn::sample_box<2>({0.2, 0.4}, {0.5, 0.7}, {.spacing = 1.0 / 128}), 1000, {1.0, 0.0});
    return simulation;
}

//! ## Start, or go on
//!
//! This function is a whole run. It starts anew, or it continues where an earlier run ended. A BackgroundSeries writes
//! states while the simulation continues. With a StateSeries, the simulation waits until a state is written. Both also
//! write `NAME.hdf.series`, which ParaView opens. With an Interruption, Ctrl-C and SIGTERM do not kill the program.
//! They end the loop, so that the last state is on disk.
//!
//! `go_on_from` keeps the states of the earlier run. Without it, a series replaces an older one of the same name.
firn::Simulation<2> run(const char* name, double end) {
    firn::Simulation<2> simulation = scene();
    firn::BackgroundSeries<float> series("out", name);
    const std::string list = std::string("out/") + name + ".hdf.series";
    if (std::filesystem::exists(list)) {
        const firn::SeriesEntry last = firn::read_series(list).back();
        firn::restore(simulation, firn::read_state<float>("out/" + last.file));
        series.go_on_from(last.time);
    } else {
        series.write(firn::state_of(simulation));
    }
    const firn::Interruption interruption;
    while (simulation.time() < end - 1e-9 && !interruption.requested()) {
        simulation.advance(0.05);
        auto state = series.spare();  // memory of a state that is on disk
        firn::state_of(simulation, state);
        series.write(std::move(state));
    }
    series.finish();  // throws if a state could not be written
    return simulation;
}

//! Every step after a restart has the same bits as in a run that was never stopped, on any number of threads.
int main() {
    for (const char* name : {"whole", "parts"}) std::filesystem::remove(std::string("out/") + name + ".hdf.series");
    auto whole = run("whole", 0.4);
    run("parts", 0.2);
    auto simulation = run("parts", 0.4);  // goes on from 0.2 s
    const bool same =
        firn::state_of(simulation) == firn::state_of(whole) && firn::read_series("out/parts.hdf.series").size() == 9;
    std::printf("stopped and gone on with: %s\n", same ? "the same bits" : "other bits");

    //! ## Several materials
    //!
    //! Write a series for each set. If the program was killed between two writes, one list is longer, so go on from the
    //! last state that all lists have:
    //!
    //! ```cpp
    //! const auto of_water = firn::read_series("out/water.hdf.series"), of_jelly = firn::read_series("out/jelly.hdf.series");
    //! const std::size_t last = std::min(of_water.size(), of_jelly.size()) - 1;
    //! firn::restore(simulation.set<Water>(), firn::read_state<float>("out/" + of_water[last].file));
    //! firn::restore(simulation.set<Jelly>(), firn::read_state<float>("out/" + of_jelly[last].file));
    //! water_series.go_on_from(of_water[last].time);
    //! jelly_series.go_on_from(of_jelly[last].time);
    //! ```
    //!
    //! ## What is refused
    //!
    //! firn refuses a state of a run with another policy, stiffness, cell size, precision, compiler or processor, and of
    //! a run with other friction, another mesh, other sources or sinks. The message says what differs. If a boundary of
    //! your own has data that are no parameters, such as a table of heights, give it a digest, so that firn can tell:
    //!
    //! ```cpp
    //! std::uint64_t digest() const { return firn::Digest().add(heights).value(); }
    //! ```
    //!
    //! Functions cannot be compared: loads, forces and acceleration fields. With Restart::other_build, firn accepts a state that another build wrote; that build
    //! rounds differently. With Restart::converted, firn moves the particles into any run: from float to double, to
    //! another transfer, to another stiffness.
    firn::Simulation<2, firn::FixedCorotated<double>> exact({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 64});
    try {
        firn::restore(exact, firn::state_of(simulation));
    } catch (const firn::io_error& refused) {
        std::printf("refused: %s\n", refused.what());
    }
    firn::restore(exact, firn::state_of(simulation), firn::Restart::converted);

    //! ## A checkpoint in memory
    //!
    //! A copy of a simulation is a checkpoint: it goes on to the same bits. Copy it before you try something, and assign it
    //! back: `const auto checkpoint = simulation; …; simulation = checkpoint;`.
    const auto checkpoint = simulation;
    auto other = checkpoint;
    simulation.advance(0.05);
    other.advance(0.05);
    const bool copies = firn::state_of(simulation) == firn::state_of(other);

    //! ## Read
    //!
    //! A state has a list of fields, each with a name. `python3 examples/read_state.py FILE` prints the same list with
    //! h5py.
    const firn::State<float> state = firn::state_of(simulation);
    for (const auto& field : state.fields)
        std::printf("%-30s %d x %zu  [%s]\n", field.name.c_str(), field.components, state.size(), field.unit.c_str());
    //! A field `NAME_remainder` holds what the numbers of the field NAME cannot: firn keeps F − I, and a float F near 1
    //! loses the last digits of a small strain.

    //! ## For other programs
    //!
    //! ParaView opens the list of a StateSeries or BackgroundSeries: all fields, triangles, times. For Blender, Houdini,
    //! Omniverse, viewers of splats, and for the mesh that was filled: [Files for other programs](21_other_programs.cpp).
    //!
    //! ## The surface of matter
    //!
    //! surface_of() makes a closed mesh of all particles of a set, or of one body, in three dimensions. It encloses the
    //! volume of the particles, follows the deformation gradient F of elastic bodies, and carries fields on its
    //! vertices. The parameters stand in firn::SurfaceOptions: a larger `radius` is smoother, a smaller `cell_size` finer.
    firn::Simulation<3, firn::Fluid<float>> water({.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 16}, {});
    const firn::Body dam = water.add(firn::sample_box<3>({0, 0, 0}, {0.4, 0.5, 1}, {.spacing = 1.0 / 32}), 1000);
    water.advance(0.1);
    const firn::SurfaceMesh surface = firn::surface_of(water, {.radius = 3.5}, {"velocity"});
    firn::write_ply("out/water_0001.ply", surface, water.time());
    firn::write_obj("out/dam_0001.obj", firn::surface_of(water, dam));  // of one body, without fields
    const double volume = firn::signed_volume(surface);
    std::printf("%zu triangles around %.3f m³ of water\n", surface.triangles.size(), volume);
    const bool right = std::abs(volume - 0.2) < 0.05 * 0.2;
    //! A surface is a state, too: `series.write(firn::state_of(surface, water.time()))` gives ParaView a film of it. The
    //! particles that have flown off alone are in `surface.alone`, for spray. Of plastic matter, such as sand and snow, F
    //! is only the elastic part; then, and of fluids, the particles around say what shape a particle has.
    //!
    //! [splashsurf](https://github.com/InteractiveComputerGraphics/splashsurf) is a program for large clouds of fluids,
    //! with more ways to smooth and to simplify. It reads the PLY files of states (`pip install pysplashsurf`):
    //!
    //! ```sh
    //! pysplashsurf reconstruct run_0001.ply -r=0.0156 -l=2.0 -c=1.0 -t=0.6 -o=run_0001_surface.ply  # r: half a spacing
    //! ```
    //!
    //! ## A picture
    //!
    //! firn draws none: ParaView, Houdini and Blender do, from the files above. The examples write their pictures by
    //! `examples/support/camera.hpp` and the files beside it, which are no part of the library and need libpng; copy
    //! them, or draw the points of `simulation.particles()` with what your program has.
    //!
    //! ## Less to write
    //!
    //! firn::StateOptions selects the fields to write, and compresses. A run cannot continue from a state with selected
    //! fields; so every n-th state can have all fields (`complete_every`).
    return same && copies && right ? 0 : 1;
}
