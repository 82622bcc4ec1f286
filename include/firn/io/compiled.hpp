/// \file Declares the functions that are compiled in the library firn::compiled_hdf5. These functions make, write, read
/// and restore states of Simulation<2> and Simulation<3>.
#pragma once

#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_series.hpp>
#include <firn/io/state_writer.hpp>

#ifdef FIRN_COMPILED_HDF5
#ifdef FIRN_COMPILES
#define FIRN_ELSEWHERE
#else
#define FIRN_ELSEWHERE extern
#endif
namespace firn::inline FIRN_BUILD {
FIRN_ELSEWHERE template void write_state(const std::filesystem::path&, const State<float>&, const StateOptions&);
FIRN_ELSEWHERE template std::filesystem::path StateSeries::write(const State<float>&);
FIRN_ELSEWHERE template State<float> read_state(const std::filesystem::path&, const StateReading&);
FIRN_ELSEWHERE template State<float> state_of(SetHandle<Simulation<2>, 0>);
FIRN_ELSEWHERE template State<float> state_of(SetHandle<Simulation<3>, 0>);
FIRN_ELSEWHERE template void state_of(SetHandle<Simulation<2>, 0>, State<float>&);
FIRN_ELSEWHERE template void state_of(SetHandle<Simulation<3>, 0>, State<float>&);
FIRN_ELSEWHERE template void restore(SetHandle<Simulation<2>, 0>, const State<float>&, Restart);
FIRN_ELSEWHERE template void restore(SetHandle<Simulation<3>, 0>, const State<float>&, Restart);
}  // namespace firn::inline FIRN_BUILD
#undef FIRN_ELSEWHERE
#endif
