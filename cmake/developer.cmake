# What only those see who build firn itself: tests, examples, benchmarks, warnings, sanitizers.
option(FIRN_BUILD_TESTS "Build firn's tests" ON)
option(FIRN_BUILD_MPI_TESTS "Build also firn's tests on several ranks, which need MPI" OFF)
option(FIRN_BUILD_EXAMPLES "Build firn's examples" ON)
option(FIRN_BUILD_BENCHMARKS "Build firn's benchmarks" OFF)
option(FIRN_BUILD_VERIFICATION "Build firn's verification suite" OFF)
option(FIRN_BUILD_FUZZERS "Build fuzzers of firn's readers (clang only)" OFF)
option(FIRN_NATIVE "Compile tests, examples and benchmarks for this machine's processor" ON)
option(FIRN_PORTABLE "Compile them so that every machine gives the same bits: no FMA, no contraction" OFF)
set(FIRN_SANITIZE "" CACHE STRING "Sanitizers for tests, examples and benchmarks, e.g. address,undefined")

# Other compilers bring other warnings; those shall not stop a stranger's build.
set(firn_known_compiler OFF)
if((CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION MATCHES "^12\\.")
   OR (CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND CMAKE_CXX_COMPILER_VERSION MATCHES "^19\\."))
    set(firn_known_compiler ON)
endif()
option(FIRN_WARNINGS_AS_ERRORS "Stop at warnings" ${firn_known_compiler})

get_property(firn_multi_config GLOBAL PROPERTY GENERATOR_IS_MULTI_CONFIG)
if(NOT CMAKE_BUILD_TYPE AND NOT firn_multi_config)
    set_property(CACHE CMAKE_BUILD_TYPE PROPERTY VALUE Release)
endif()
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_CXX_SCAN_FOR_MODULES OFF) # firn has none, and the scan needs a tool that clang's package leaves out

# Linked, privately, by everything that is ours and is no part of the library.
add_library(firn_developer INTERFACE)
if(FIRN_SANITIZE AND NOT FIRN_WARNINGS_AS_ERRORS)
    target_compile_options(firn_developer INTERFACE -w) # an eighth of the time to compile, and nobody reads them
else()
    target_compile_options(firn_developer INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion)
endif()
# Two warnings of g++ 12 are false with -O3: std::string's operator+ (GCC bug 105651) and its own AVX-512 intrinsics.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION MATCHES "^12\\.")
    target_compile_options(firn_developer INTERFACE -Wno-restrict -Wno-maybe-uninitialized)
endif()
if(FIRN_WARNINGS_AS_ERRORS)
    target_compile_options(firn_developer INTERFACE -Werror)
endif()
if(FIRN_PORTABLE)
    target_compile_options(firn_developer INTERFACE -ffp-contract=off)
    target_compile_definitions(firn_developer INTERFACE FIRN_TEST_PORTABLE=1)
    if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
        target_compile_options(firn_developer INTERFACE -march=x86-64)
    endif()
elseif(FIRN_NATIVE)
    include(CheckCXXCompilerFlag)
    check_cxx_compiler_flag(-march=native firn_has_march_native)
    if(firn_has_march_native)
        target_compile_options(firn_developer INTERFACE -march=native)
        if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang") # clang 19 finds fault with its own features of AVX10 processors
            target_compile_options(firn_developer INTERFACE -Wno-unknown-warning-option
                                                            -Wno-invalid-feature-combination)
        endif()
    endif()
endif()
if(FIRN_SANITIZE)
    target_compile_options(
        firn_developer INTERFACE "-fsanitize=${FIRN_SANITIZE}" -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(firn_developer INTERFACE "-fsanitize=${FIRN_SANITIZE}")
endif()

enable_testing() # examples and benchmarks have tests, too
if(FIRN_BUILD_TESTS)
    add_subdirectory(tests)
endif()
if(FIRN_BUILD_EXAMPLES)
    add_subdirectory(examples)
endif()
if(FIRN_BUILD_BENCHMARKS)
    add_subdirectory(benchmarks)
endif()
if(FIRN_BUILD_VERIFICATION)
    add_subdirectory(benchmarks/verification)
endif()

# The site, reference and guide: build/docs/html/index.html.
add_custom_target(firn_docs COMMAND python3 "${PROJECT_SOURCE_DIR}/cmake/docs/build.py" --output
                                    "${PROJECT_BINARY_DIR}/docs" USES_TERMINAL VERBATIM)
