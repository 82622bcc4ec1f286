# What the three consumers share: two translation units that both include all of firn, with and without HDF5.
add_library(other_unit OBJECT "${CMAKE_CURRENT_LIST_DIR}/other.cpp")
target_link_libraries(other_unit PRIVATE firn::firn)

add_executable(consumer "${CMAKE_CURRENT_LIST_DIR}/main.cpp" $<TARGET_OBJECTS:other_unit>)
target_link_libraries(consumer PRIVATE firn::firn)

add_executable(consumer_hdf5 "${CMAKE_CURRENT_LIST_DIR}/main.cpp" $<TARGET_OBJECTS:other_unit>)
target_link_libraries(consumer_hdf5 PRIVATE firn::hdf5)
target_compile_definitions(consumer_hdf5 PRIVATE CONSUMER_HDF5)

foreach(target IN ITEMS consumer consumer_hdf5)
    target_compile_definitions(${target} PRIVATE EXPECTED_VERSION="${FIRN_EXPECTED_VERSION}")
endforeach()

# Only in name: ../compiled builds it.
if(FIRN_SOURCE_DIR AND NOT (TARGET firn::compiled AND TARGET firn::compiled_hdf5))
    message(FATAL_ERROR "firn::compiled is not there")
endif()

# Nothing of firn's own development reaches a consumer.
get_property(cached DIRECTORY "${CMAKE_SOURCE_DIR}" PROPERTY CACHE_VARIABLES)
foreach(option IN ITEMS FIRN_BUILD_TESTS FIRN_BUILD_EXAMPLES FIRN_BUILD_BENCHMARKS FIRN_NATIVE FIRN_PORTABLE
                        FIRN_SANITIZE FIRN_WARNINGS_AS_ERRORS)
    if(option IN_LIST cached)
        message(FATAL_ERROR "the developer option ${option} is shown to a consumer")
    endif()
endforeach()
foreach(target IN ITEMS firn_developer firn_test_main firn_header_check)
    if(TARGET ${target})
        message(FATAL_ERROR "the developer target ${target} is shown to a consumer")
    endif()
endforeach()
get_target_property(options firn::firn INTERFACE_COMPILE_OPTIONS)
if(options MATCHES "-W(all|extra|error|conversion)|-march|-fsanitize|-ffast-math|-O[0-9]")
    message(FATAL_ERROR "a consumer gets the options ${options}")
endif()
if(CMAKE_EXPORT_COMPILE_COMMANDS OR NOT "${CMAKE_BUILD_TYPE}" STREQUAL "${given_build_type}")
    message(FATAL_ERROR "firn has set a consumer's global variables")
endif()

enable_testing()
add_test(NAME consumer COMMAND consumer)
add_test(NAME consumer_hdf5 COMMAND consumer_hdf5)
