/// \file Reads a state from an HDF5 file that write_state() wrote. Before firn allocates memory, it checks the names,
/// ranks, extents and types of the datasets, and whether a file of this size can contain datasets of these sizes.
///
/// Damage to the file is detected: HDF5's checksums cover everything except the values in datasets, and firn's digest
/// covers these values. If a file was damaged, HDF5 1.10 may print "infinite loop closing library" when the program
/// ends; this is harmless.
///
/// HDF5 parses the file before firn can check it. Do not open files from untrusted sources with a version of HDF5 that
/// lacks security fixes.
#pragma once

#include <firn/io/needs_hdf5.hpp>
#include <firn/io/state.hpp>

#include <filesystem>

namespace firn::inline FIRN_BUILD {

/// Options of read_state().
struct StateReading {
    /// Whether read_state() throws an error if the state does not match its digest. If `verify` is false, read_state()
    /// also reads states whose values are damaged, or were changed by another program.
    bool verify = true;
};

/// Reads a state from an HDF5 file. The values have exactly the bits that were written. State::fields has the field
/// "position" first, then the other fields in the order in which they were written. State::attributes has all
/// attributes of the group /firn that are texts.
/// \tparam S  precision of the state in the file, float or double
/// \param path     the name of the file
/// \param reading  options: whether the state is compared with its digest (files of schema_version 1 have no digest)
/// \throws io_error  if the file is missing, truncated, damaged or not a state of firn, if the precision of the state
///                   is not S, if the schema_version of the file is later than that of this firn, if sizes in the file
///                   contradict each other, or if the state does not match its digest; the message names the file and
///                   the reason
template <state_scalar S>
[[nodiscard]] State<S> read_state(const std::filesystem::path& path, const StateReading& reading = {});

}  // namespace firn::inline FIRN_BUILD

#if FIRN_HAS_BODIES_OF_STATES
#include <firn/io/state_reader-inl.hpp>
#endif
