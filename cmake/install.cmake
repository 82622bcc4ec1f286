# Installs the headers, the targets and the package that find_package(firn) reads: with the project, or, without
# FIRN_INSTALL, only when asked by cmake --install FOLDER --component firn. In each case a library can export what links
# firn::firn; its package then calls find_dependency(firn).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(firn_package_dir "${CMAKE_INSTALL_DATADIR}/cmake/firn")
set(firn_rule COMPONENT firn)
if(NOT FIRN_INSTALL)
    list(APPEND firn_rule EXCLUDE_FROM_ALL)
endif()

install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/firn" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" ${firn_rule})
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/licenses/firn" ${firn_rule})

target_include_directories(firn INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
foreach(part IN ITEMS "" Hdf5 Webgpu Mpi)
    string(TOLOWER "firn_${part}" target)
    string(REGEX REPLACE "_$" "" target "${target}")
    install(TARGETS ${target} EXPORT firn${part}Targets)
    install(EXPORT firn${part}Targets NAMESPACE firn:: DESTINATION "${firn_package_dir}" ${firn_rule})
    export(EXPORT firn${part}Targets NAMESPACE firn:: FILE "${PROJECT_BINARY_DIR}/firn${part}Targets.cmake")
endforeach()

configure_package_config_file(
    "${PROJECT_SOURCE_DIR}/cmake/firnConfig.cmake.in" "${PROJECT_BINARY_DIR}/firnConfig.cmake"
    INSTALL_DESTINATION "${firn_package_dir}"
    NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(
    "${PROJECT_BINARY_DIR}/firnConfigVersion.cmake"
    COMPATIBILITY SameMinorVersion # until 1.0 a minor version may change the interface
    ARCH_INDEPENDENT)
install(FILES "${PROJECT_BINARY_DIR}/firnConfig.cmake" "${PROJECT_BINARY_DIR}/firnConfigVersion.cmake"
              "${PROJECT_SOURCE_DIR}/cmake/firnDependencies.cmake" DESTINATION "${firn_package_dir}" ${firn_rule})

# For builds without CMake: pkg-config --cflags --libs firn, firn-hdf5 or firn-mpi. Which compiler will read them is not
# known, so that they have the option of g++ 12 (see ../CMakeLists.txt), which later ones take, too.
file(RELATIVE_PATH firn_prefix_from_pc "/prefix/${CMAKE_INSTALL_DATADIR}/pkgconfig" "/prefix")
string(REGEX REPLACE "/$" "" firn_prefix_from_pc "${firn_prefix_from_pc}")
set(firn_pc_openmp "")
if(FIRN_OPENMP)
    set(firn_pc_openmp "-fopenmp ")
endif()
foreach(package IN ITEMS firn firn-hdf5 firn-mpi)
    configure_file("${CMAKE_CURRENT_LIST_DIR}/${package}.pc.in" "${PROJECT_BINARY_DIR}/${package}.pc" @ONLY)
    install(FILES "${PROJECT_BINARY_DIR}/${package}.pc" DESTINATION "${CMAKE_INSTALL_DATADIR}/pkgconfig" ${firn_rule})
endforeach()
