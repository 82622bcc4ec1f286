# What firn asks of the machine that compiles. The source tree and the installed package both read this file, so that
# what one compiler installed serves another, with or without OpenMP and HDF5.
# BUILD_INTERFACE keeps what was found here out of the exported targets: each consumer finds its own.

# For threads that write states in the background, and firn's own (core/own_threads.hpp).
macro(firn_link_threads target)
    find_package(Threads REQUIRED)
    target_link_libraries(${target} INTERFACE $<BUILD_INTERFACE:Threads::Threads>)
endmacro()

# Loops run on OpenMP's threads; without it, on the calling thread.
macro(firn_link_openmp target)
    find_package(OpenMP QUIET COMPONENTS CXX)
    if(OpenMP_CXX_FOUND)
        target_link_libraries(${target} INTERFACE $<BUILD_INTERFACE:OpenMP::OpenMP_CXX>)
    else()
        message(STATUS "firn: ${CMAKE_CXX_COMPILER_ID} has no OpenMP here; loops run on one thread")
    endif()
endmacro()

# Eigen: for firn/core/eigen.hpp, the one header that includes it.
macro(firn_link_eigen target)
    find_package(Eigen3 REQUIRED NO_MODULE)
    target_link_libraries(${target} INTERFACE $<BUILD_INTERFACE:Eigen3::Eigen>)
endmacro()

# A library with WebGPU's C interface (Dawn, wgpu-native) as firn_webgpu_library, with the folder of webgpu/webgpu.h in
# its present revision; empty if there is none.
macro(firn_find_webgpu)
    find_path(FIRN_WEBGPU_HEADER_DIR webgpu/webgpu.h DOC "The folder of webgpu/webgpu.h, for firn::webgpu")
    find_library(FIRN_WEBGPU_LIBRARY NAMES webgpu_dawn wgpu_native DOC "A library with webgpu.h's functions")
    mark_as_advanced(FIRN_WEBGPU_HEADER_DIR FIRN_WEBGPU_LIBRARY)
    set(firn_webgpu_library "")
    if(FIRN_WEBGPU_HEADER_DIR AND FIRN_WEBGPU_LIBRARY)
        # Earlier revisions have other functions by the same names.
        file(STRINGS "${FIRN_WEBGPU_HEADER_DIR}/webgpu/webgpu.h" firn_webgpu_revision
             REGEX "struct WGPUPopErrorScopeCallbackInfo {")
        if(firn_webgpu_revision)
            set(firn_webgpu_library "${FIRN_WEBGPU_LIBRARY}")
        else()
            message(STATUS "${FIRN_WEBGPU_HEADER_DIR}/webgpu/webgpu.h is too old for firn::webgpu")
        endif()
    endif()
endmacro()

# HDF5's C library, the target firn_hdf5_library; empty if there is none.
#
# What HDF5's own build installs are targets hdf5-shared and hdf5-static, or one of them; by versions in the namespace
# hdf5::. CMake's search loads them, yet makes hdf5::hdf5 of the shared one only, or is passed over by a project that
# prefers packages' own files. They come first: a project has them only because someone chose this HDF5.
macro(firn_find_hdf5)
    get_property(firn_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
    if(NOT "C" IN_LIST firn_languages)
        enable_language(C) # CMake's search compiles a C program
    endif()
    find_package(HDF5 QUIET COMPONENTS C)
    set(firn_hdf5_kinds shared static)
    if(HDF5_USE_STATIC_LIBRARIES)
        set(firn_hdf5_kinds static shared)
    endif()
    set(firn_hdf5_library "")
    foreach(firn_hdf5_kind IN LISTS firn_hdf5_kinds)
        foreach(firn_hdf5_target IN ITEMS hdf5::hdf5-${firn_hdf5_kind} hdf5-${firn_hdf5_kind})
            if(NOT firn_hdf5_library AND TARGET ${firn_hdf5_target})
                set(firn_hdf5_library ${firn_hdf5_target})
            endif()
        endforeach()
    endforeach()
    if(NOT firn_hdf5_library AND TARGET hdf5::hdf5)
        set(firn_hdf5_library hdf5::hdf5)
    endif()
endmacro()

# MPI, as C++ programs link it: the target firn_mpi_library; empty if there is none. CMake's search reports that
# pkg-config has no package mpi-cxx, though it was asked to be quiet, and that looks like a failure.
macro(firn_find_mpi)
    set(firn_log_level "${CMAKE_MESSAGE_LOG_LEVEL}")
    set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)
    find_package(MPI QUIET COMPONENTS CXX)
    set(CMAKE_MESSAGE_LOG_LEVEL "${firn_log_level}")
    set(firn_mpi_library "")
    if(MPI_CXX_FOUND)
        set(firn_mpi_library MPI::MPI_CXX)
    endif()
endmacro()

# Links what firn_find_COMPONENT has found to the component's target.
macro(firn_link_component target component)
    target_link_libraries(${target} INTERFACE $<BUILD_INTERFACE:${firn_${component}_library}>)
    if("${component}" STREQUAL "webgpu")
        target_include_directories(${target} SYSTEM INTERFACE $<BUILD_INTERFACE:${FIRN_WEBGPU_HEADER_DIR}>)
    endif()
endmacro()

# firn::compiled: the common simulations compiled once, by the project that uses them, for its processor and with its
# options; firn::compiled_hdf5: their states. They are built where something links them, and so that shared libraries
# and Python modules can link them, unless the project decides by CMAKE_POSITION_INDEPENDENT_CODE.
function(firn_add_compiled include_folder)
    if(NOT DEFINED CMAKE_POSITION_INDEPENDENT_CODE)
        set(CMAKE_POSITION_INDEPENDENT_CODE ON) # of this function
    endif()
    set(folder "${include_folder}/firn/compiled")
    if(NOT TARGET firn_compiled)
        add_library(
            firn_compiled STATIC EXCLUDE_FROM_ALL
            "${folder}/core_2d_float.cpp" "${folder}/core_2d_double.cpp" "${folder}/core_3d_float.cpp"
            "${folder}/core_3d_double.cpp" "${folder}/simulation_2d.cpp" "${folder}/simulation_3d.cpp")
        target_link_libraries(firn_compiled PUBLIC firn::firn)
        target_compile_definitions(firn_compiled PUBLIC FIRN_COMPILED)
        add_library(firn::compiled ALIAS firn_compiled)
    endif()
    if(TARGET firn::hdf5 AND NOT TARGET firn_compiled_hdf5)
        add_library(firn_compiled_hdf5 STATIC EXCLUDE_FROM_ALL "${folder}/states.cpp")
        target_link_libraries(firn_compiled_hdf5 PUBLIC firn_compiled firn::hdf5)
        target_compile_definitions(firn_compiled_hdf5 PUBLIC FIRN_COMPILED_HDF5)
        add_library(firn::compiled_hdf5 ALIAS firn_compiled_hdf5)
    endif()
endfunction()

# Without a build type CMake compiles without optimisation, some hundred times slower, and does not say so. It is looked
# at when the project has been read: it may set its build type after it has found firn.
function(firn_check_build_type)
    get_property(multi_config GLOBAL PROPERTY GENERATOR_IS_MULTI_CONFIG)
    get_directory_property(options COMPILE_OPTIONS)
    if(NOT multi_config AND NOT CMAKE_BUILD_TYPE AND NOT "${CMAKE_CXX_FLAGS} ${options}" MATCHES "-O[1-9sfgz]")
        message(NOTICE "firn: CMAKE_BUILD_TYPE is not set, so programs are compiled without optimisation and are some "
                       "hundred times slower. Configure with -DCMAKE_BUILD_TYPE=Release.")
    endif()
endfunction()
macro(firn_notice_build_type)
    get_property(firn_looks_at_build_type GLOBAL PROPERTY FIRN_LOOKS_AT_BUILD_TYPE)
    if(NOT firn_looks_at_build_type)
        set_property(GLOBAL PROPERTY FIRN_LOOKS_AT_BUILD_TYPE TRUE)
        cmake_language(DEFER DIRECTORY "${CMAKE_SOURCE_DIR}" CALL firn_check_build_type)
    endif()
endmacro()
