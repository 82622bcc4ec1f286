# firn_example_support: what examples/support needs besides firn: PNG pictures, command lines, Boost's headers.
if(TARGET firn_example_support)
    return()
endif()

find_package(PNG REQUIRED)
find_package(CLI11 REQUIRED)
find_package(Boost REQUIRED CONFIG)

add_library(firn_example_support INTERFACE)
target_include_directories(firn_example_support INTERFACE "${CMAKE_CURRENT_LIST_DIR}")
target_compile_definitions(firn_example_support INTERFACE FIRN_EXAMPLES_DATA_DIR="${CMAKE_CURRENT_LIST_DIR}/data")
target_link_libraries(firn_example_support INTERFACE firn::hdf5 PNG::PNG CLI11::CLI11 Boost::headers)
