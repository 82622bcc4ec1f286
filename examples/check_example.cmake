# cmake -DPROGRAM=… -DMODE=small|help -DOUTPUT=… -P check_example.cmake
# Runs an example at small size in the empty folder OUTPUT and looks for what it promises to write.
file(REMOVE_RECURSE "${OUTPUT}")
file(MAKE_DIRECTORY "${OUTPUT}")
get_filename_component(program "${PROGRAM}" NAME_WE)
string(REGEX REPLACE "^[0-9]+_" "" name "${program}")

function(run)
    execute_process(COMMAND "${PROGRAM}" ${ARGV} WORKING_DIRECTORY "${OUTPUT}" RESULT_VARIABLE result)
    if(NOT result EQUAL 0)
        message(FATAL_ERROR "${program} ${ARGV} ended with ${result}")
    endif()
endfunction()

if(program STREQUAL "01_hello") # no options, and it may write what it likes
    run()
    return()
endif()
run(--help)
if(MODE STREQUAL "help")
    return()
endif()

run(--particles 2000 --steps 20 --frames 2 --output "${OUTPUT}/a folder")
foreach(file IN ITEMS "${name}_0000.hdf" "${name}.hdf.series" "${name}.png")
    if(NOT EXISTS "${OUTPUT}/a folder/${file}")
        message(FATAL_ERROR "${program} has not written ${file}")
    endif()
    file(SIZE "${OUTPUT}/a folder/${file}" size)
    if(size EQUAL 0)
        message(FATAL_ERROR "${program} has written an empty ${file}")
    endif()
endforeach()

# The initial state and the state after the last step are always written.
file(READ "${OUTPUT}/a folder/${name}.hdf.series" series)
file(GLOB states "${OUTPUT}/a folder/${name}_*.hdf")
list(LENGTH states written)
string(JSON listed LENGTH "${series}" files)
if(written LESS 2 OR NOT listed EQUAL written)
    message(FATAL_ERROR "${written} states are written, ${listed} are listed in ${name}.hdf.series")
endif()
