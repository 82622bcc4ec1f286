# cmake -DSOURCE=… -DBINARY=… -DCTEST=… -P build_and_test.cmake -- <configure option>...
# Configures SOURCE afresh in BINARY, builds it and runs its tests.
set(options "")
set(after_dashes OFF)
math(EXPR last "${CMAKE_ARGC} - 1")
foreach(index RANGE ${last})
    if(after_dashes)
        list(APPEND options "${CMAKE_ARGV${index}}")
    elseif(CMAKE_ARGV${index} STREQUAL "--")
        set(after_dashes ON)
    endif()
endforeach()

function(run)
    execute_process(COMMAND ${ARGV} RESULT_VARIABLE result)
    if(NOT result EQUAL 0)
        message(FATAL_ERROR "failed: ${ARGV}")
    endif()
endfunction()

file(REMOVE_RECURSE "${BINARY}")
run("${CMAKE_COMMAND}" -S "${SOURCE}" -B "${BINARY}" ${options})
run("${CMAKE_COMMAND}" --build "${BINARY}" --config Debug)
run("${CMAKE_COMMAND}" -E chdir "${BINARY}" "${CTEST}" -C Debug --output-on-failure --no-tests=error)
