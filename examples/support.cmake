# firn_example_support: examples/support, with what it needs besides firn: PNG pictures, command lines, Boost's headers.
# What no type of a simulation affects is compiled once for all examples.
if(TARGET firn_example_support)
    return()
endif()

find_package(PNG REQUIRED)
find_package(CLI11 REQUIRED)
find_package(Boost REQUIRED CONFIG)

add_library(firn_example_support STATIC "${CMAKE_CURRENT_LIST_DIR}/support/options.cpp"
                                        "${CMAKE_CURRENT_LIST_DIR}/support/renderer.cpp")
# It reads a few words: what costs time is to compile it.
set_source_files_properties("${CMAKE_CURRENT_LIST_DIR}/support/options.cpp" PROPERTIES COMPILE_OPTIONS -O0)
target_include_directories(firn_example_support PUBLIC "${CMAKE_CURRENT_LIST_DIR}")
target_compile_definitions(firn_example_support PUBLIC FIRN_EXAMPLES_DATA_DIR="${CMAKE_CURRENT_LIST_DIR}/data")
target_compile_options(firn_example_support PRIVATE ${FIRN_EXAMPLE_OPTIONS})
target_link_libraries(firn_example_support PUBLIC firn::hdf5 PNG::PNG CLI11::CLI11 Boost::headers)
if(TARGET firn_developer)
    target_link_libraries(firn_example_support PRIVATE firn_developer)
endif()
