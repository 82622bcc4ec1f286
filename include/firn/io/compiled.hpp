/// \file Declares the functions that are compiled in the library firn::compiled_hdf5. These functions make, write, read
/// and restore states, of any material.
#pragma once

#include <firn/io/restart.hpp>
#include <firn/io/simulation_state.hpp>
#include <firn/io/state_reader.hpp>
#include <firn/io/state_series.hpp>
#include <firn/io/state_writer.hpp>

#ifdef FIRN_COMPILED_HDF5
#if FIRN_COMPILES == FIRN_STATES
#define FIRN_ELSEWHERE
#else
#define FIRN_ELSEWHERE extern
#endif
#define FIRN_FILES_OF(where, S)                                                                          \
    where template void write_state(const std::filesystem::path&, const State<S>&, const StateOptions&); \
    where template std::filesystem::path StateSeries::write(const State<S>&);                            \
    where template State<S> read_state(const std::filesystem::path&, const StateReading&);               \
    where template void detail::check_same(const State<S>&, const std::vector<StateAttribute>&, const char*);
#define FIRN_STATES_OF(where, S, D)                                                                             \
    where template void detail::fill_state_of(const RunOf<S, D>&, const SetOf<S, D>&, detail::PolicyFacts, int, \
                                              State<S>&);
/// A state of the precision T may be restored to a simulation of the precision S. \see Restart::converted
#define FIRN_STATES_FOR(where, S, D, T)                                                                          \
    where template void detail::check_same_run(const detail::PolicyFacts&, const Domain<D>&, const SetOf<S, D>&, \
                                               const State<T>&, Restart);                                        \
    where template detail::RestoredRun detail::read_particles(const State<T>&, Restart, const KernelFacts&, int, \
                                                              SetOf<S, D>&);
namespace firn::inline FIRN_BUILD {
FIRN_FILES_OF(FIRN_ELSEWHERE, float)
FIRN_FILES_OF(FIRN_ELSEWHERE, double)
FIRN_STATES_OF(FIRN_ELSEWHERE, float, 2)
FIRN_STATES_OF(FIRN_ELSEWHERE, float, 3)
FIRN_STATES_OF(FIRN_ELSEWHERE, double, 2)
FIRN_STATES_OF(FIRN_ELSEWHERE, double, 3)
FIRN_STATES_FOR(FIRN_ELSEWHERE, float, 2, float)
FIRN_STATES_FOR(FIRN_ELSEWHERE, float, 2, double)
FIRN_STATES_FOR(FIRN_ELSEWHERE, float, 3, float)
FIRN_STATES_FOR(FIRN_ELSEWHERE, float, 3, double)
FIRN_STATES_FOR(FIRN_ELSEWHERE, double, 2, float)
FIRN_STATES_FOR(FIRN_ELSEWHERE, double, 2, double)
FIRN_STATES_FOR(FIRN_ELSEWHERE, double, 3, float)
FIRN_STATES_FOR(FIRN_ELSEWHERE, double, 3, double)
}  // namespace firn::inline FIRN_BUILD
#undef FIRN_ELSEWHERE
#undef FIRN_FILES_OF
#undef FIRN_STATES_OF
#undef FIRN_STATES_FOR
#endif
