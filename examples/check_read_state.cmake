# cmake -DPROGRAM=python3 -DSCRIPT=…/read_state.py -DOUTPUT=… -P check_read_state.cmake
# Without h5py, without a state and with another file, read_state.py ends with one sentence. The h5py is not the real one.
file(REMOVE_RECURSE "${OUTPUT}")
file(MAKE_DIRECTORY "${OUTPUT}")

# refused(<source of h5py> <sentence> <argument>...)
function(refused h5py sentence)
    file(WRITE "${OUTPUT}/h5py.py" "${h5py}")
    execute_process(COMMAND "${CMAKE_COMMAND}" -E env "PYTHONPATH=${OUTPUT}" PYTHONDONTWRITEBYTECODE=1 "${PROGRAM}"
                            "${SCRIPT}" ${ARGN} RESULT_VARIABLE result ERROR_VARIABLE complained)
    if(NOT result EQUAL 1 OR NOT complained MATCHES "^${sentence}[^\n]*\n$")
        message(FATAL_ERROR "read_state.py ${ARGN} ended with ${result}: ${complained}")
    endif()
endfunction()

refused("raise ImportError('no libhdf5')" "read_state.py needs h5py .no libhdf5.. Install it" "a.hdf")
set(reader "def File(name): raise OSError('no signature')")
refused("${reader}" "Give one state")
refused("${reader}" "a.txt is not a state" "a.txt")
