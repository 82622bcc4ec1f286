# What firn asks of the machine that compiles. The source tree and the installed package both read this file, so that
# what one compiler installed serves another, with or without OpenMP and HDF5.
# BUILD_INTERFACE keeps what was found here out of the exported targets: each consumer finds its own.

# The threads that loops are shared out among.
macro(firn_link_threads target)
    find_package(Threads REQUIRED)
    target_link_libraries(${target} INTERFACE $<BUILD_INTERFACE:Threads::Threads>)
endmacro()

# OpenMP's settings say how many threads there are; with FIRN_OPENMP_THREADS they are OpenMP's own.
macro(firn_link_openmp target)
    find_package(OpenMP QUIET COMPONENTS CXX)
    if(OpenMP_CXX_FOUND)
        target_link_libraries(${target} INTERFACE $<BUILD_INTERFACE:OpenMP::OpenMP_CXX>)
    endif()
endmacro()

# HDF5's C library. A target that has none is left as it is, with firn_hdf5_found false.
macro(firn_link_hdf5 target)
    get_property(firn_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
    if(NOT "C" IN_LIST firn_languages)
        enable_language(C) # CMake's search compiles a C program
    endif()
    find_package(HDF5 QUIET COMPONENTS C)
    set(firn_hdf5_found ${HDF5_FOUND})
    if(HDF5_FOUND)
        target_link_libraries(${target} INTERFACE $<BUILD_INTERFACE:hdf5::hdf5>)
    endif()
endmacro()
