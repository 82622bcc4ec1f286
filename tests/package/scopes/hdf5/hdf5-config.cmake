# As HDF5's own build installs it, with one of its two libraries.
set(HDF5_INCLUDE_DIR "${CMAKE_CURRENT_LIST_DIR}")
add_library(${hdf5_namespace}hdf5-${hdf5_kind} UNKNOWN IMPORTED)
set_target_properties(
    ${hdf5_namespace}hdf5-${hdf5_kind} PROPERTIES IMPORTED_LOCATION "${CMAKE_CURRENT_LIST_FILE}"
                                                  INTERFACE_INCLUDE_DIRECTORIES "${CMAKE_CURRENT_LIST_DIR}")
