//! # States and restart
//!
//! A *state* is all that a run needs to go on, as named arrays with units, in an HDF5 file. A state is written under
//! another name, checked, synced and renamed: a program that is killed, or a disk that is full, leaves whole files
//! only.
#include <firn/firn.hpp>
#include <firn/io/states.hpp>

#include <cstdio>

firn::Simulation<2> scene() {
    firn::Simulation<2> simulation({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 64});
    simulation.add(firn::sample_box<2>({0.2, 0.4}, {0.5, 0.7}, {.spacing = 1.0 / 128}), 1000, {1.0, 0.0});
    return simulation;
}

int main() {
    //! ## Write
    //!
    //! A BackgroundSeries writes while the simulation goes on; a StateSeries writes at once. Both make
    //! `NAME.hdf.series`, which ParaView opens. An Interruption turns Ctrl-C and SIGTERM into the end of the run, so
    //! that its last state is on disk.
    firn::Simulation<2> simulation = scene();
    {
        firn::BackgroundSeries<float> series("out", "run");
        const firn::Interruption interruption;
        while (simulation.steps() < 200 && !interruption.requested()) {
            simulation.step();
            if (simulation.steps() % 100 != 0) continue;
            auto state = series.spare();  // memory of a state that is on disk
            firn::state_of(simulation, state);
            series.write(std::move(state));
        }
        series.finish();  // throws if a state could not be written
    }

    //! ## Go on
    //!
    //! Another program, made in the same way, takes the last state. Every further step has the bits of a run that was
    //! never stopped, on any number of threads.
    firn::Simulation<2> other = scene();
    const firn::SeriesEntry last = firn::read_series("out/run.hdf.series").back();
    firn::restore(other, firn::read_state<float>("out/" + last.file));
    simulation.advance(0.1);
    other.advance(0.1);
    const bool same = firn::state_of(simulation) == firn::state_of(other);
    std::printf("from step %llu on: %s\n", static_cast<unsigned long long>(other.steps()),
                same ? "the same bits" : "other bits");

    //! A run of another policy, stiffness, cell, precision, compiler or processor is refused with a sentence that says
    //! what differs. Restart::other_build takes the same run from another build, whose roundings were others.
    //! Restart::converted takes the particles into any run: float to double, another transfer, another stiffness.
    firn::Simulation<2, firn::FixedCorotated<double>> exact({.lower = {0, 0}, .upper = {1, 1}, .cell_size = 1.0 / 64});
    try {
        firn::restore(exact, firn::state_of(simulation));
    } catch (const firn::io_error& refused) {
        std::printf("refused: %s\n", refused.what());
    }
    firn::restore(exact, firn::state_of(simulation), firn::Restart::converted);

    //! ## Read
    //!
    //! A state has fields by name. `python3 examples/read_state.py FILE` does the same with h5py.
    const firn::State<float> state = firn::state_of(simulation);
    for (const auto& field : state.fields)
        std::printf("%-24s %d x %zu  [%s]\n", field.name.c_str(), field.components, state.size(), field.unit.c_str());

    //! ## For other programs
    //!
    //! | for | write | with |
    //! | --- | --- | --- |
    //! | ParaView | a StateSeries or BackgroundSeries | all fields, triangles, times |
    //! | Houdini, Blender | `write_ply("run_0001.ply", state, {"velocity"})` (`firn/io/ply.hpp`) | points, ids, fields
    //! that you name | | Houdini, Blender | `write_obj("cloth_0001.obj", state)` (`firn/io/obj.hpp`) | points and
    //! triangles | | anything that reads points | `write_obj_points("run_0001.obj", points)` | points |
    //!
    //! firn::StateOptions selects fields, with every n-th state complete to go on from, and compresses.
    return same ? 0 : 1;
}
