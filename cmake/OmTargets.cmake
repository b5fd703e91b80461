# How a room joins the library, how a test, a bench and a fuzz target are made.

add_library(om_flags INTERFACE)
target_compile_options(om_flags INTERFACE
    -Wall -Wextra -Wpedantic -Wshadow -Wvla -Wmissing-prototypes -Wfloat-conversion
    -Wdouble-promotion -Wno-missing-field-initializers -ffp-contract=off)
# clang takes INFINITY and NAN, floats by the standard, for promotions; gcc looks for the real ones
target_compile_options(om_flags INTERFACE $<$<C_COMPILER_ID:Clang>:-Wno-double-promotion>)
if(OM_WERROR)
    target_compile_options(om_flags INTERFACE -Werror)
endif()
target_compile_definitions(om_flags INTERFACE _POSIX_C_SOURCE=200809L)
if(OM_SANITIZE)
    target_compile_options(om_flags INTERFACE -fsanitize=${OM_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    # at -O1 these two find what is not there; the release build looks for them
    target_compile_options(om_flags INTERFACE -Wno-format-truncation -Wno-maybe-uninitialized)
    target_link_options(om_flags INTERFACE -fsanitize=${OM_SANITIZE} -fno-sanitize-recover=all)
    target_compile_definitions(om_flags INTERFACE OM_SANITIZED)
endif()
if(OM_WITH_OPENMP)
    target_compile_definitions(om_flags INTERFACE OM_WITH_OPENMP)
    target_compile_options(om_flags INTERFACE ${OpenMP_C_FLAGS})
endif()

# om_room(NAME files...): add the room's source files to the library.
function(om_room name)
    foreach(file IN LISTS ARGN)
        target_sources(omentum_objects PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    endforeach()
endfunction()

# The shared library users link, and a static one with every symbol in reach for the tests.
function(om_finish_library)
    target_include_directories(omentum_objects PUBLIC
        $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_include_directories(omentum_objects SYSTEM PRIVATE
        ${CHOLMOD_INCLUDE} $<$<NOT:$<BOOL:${OM_WITH_GPL}>>:${SUPERLU_INCLUDE}> ${ARPACK_INCLUDE} ${EMBREE_INCLUDE} ${HDF5_INCLUDE} ${DNNL_INCLUDE} ${PNG_INCLUDE_DIRS} ${ZLIB_INCLUDE_DIRS})
    target_include_directories(omentum_objects PRIVATE ${PROJECT_SOURCE_DIR}/src)
    target_link_libraries(omentum_objects PRIVATE om_flags PkgConfig::YAML PkgConfig::NLOPT PkgConfig::JANSSON PkgConfig::WEBSOCKETS omentum_dds_types)
    set(libs ${CHOLMOD_LIBRARY} ${OM_LU_LIBRARY} ${ARPACK_LIBRARY} ${OPENBLAS_LIBRARY} ${EMBREE_LIBRARY} ${CLINGO_LIBRARY} ${HDF5_LIBRARY} ${DNNL_LIBRARY}
        PNG::PNG ZLIB::ZLIB PkgConfig::YAML PkgConfig::NLOPT PkgConfig::JANSSON PkgConfig::WEBSOCKETS PkgConfig::CYCLONEDDS Threads::Threads ${CMAKE_DL_LIBS} m)
    if(OM_WITH_OPENMP)
        list(APPEND libs OpenMP::OpenMP_C)
    endif()
    if(OM_WITH_MPI)
        target_compile_definitions(omentum_objects PRIVATE OM_WITH_MPI)
        target_link_libraries(omentum_objects PRIVATE MPI::MPI_C)
        list(APPEND libs MPI::MPI_C)
    endif()
    add_library(omentum SHARED $<TARGET_OBJECTS:omentum_objects> $<TARGET_OBJECTS:omentum_dds_types>)
    # Before 1.0 each minor version may change the interface, so it is part of the soname.
    set_target_properties(omentum PROPERTIES VERSION ${PROJECT_VERSION}
        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
    target_link_options(omentum PRIVATE -Wl,--as-needed
        -Wl,--version-script=${PROJECT_SOURCE_DIR}/cmake/omentum.map)
    set_target_properties(omentum PROPERTIES LINK_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/omentum.map)
    if(NOT OM_SANITIZE)
        target_link_options(omentum PRIVATE -Wl,--no-undefined)
    endif()
    add_library(omentum_static STATIC EXCLUDE_FROM_ALL $<TARGET_OBJECTS:omentum_objects> $<TARGET_OBJECTS:omentum_dds_types>)
    foreach(lib omentum omentum_static)
        target_include_directories(${lib} PUBLIC
            $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
        target_link_libraries(${lib} PRIVATE ${libs} $<BUILD_INTERFACE:om_flags> INTERFACE m)  # inline functions use it
    endforeach()
endfunction()

# Seconds after which a test hangs, on an idle machine; sanitizers take three to five times as long.
set(OM_TEST_TIMEOUT 300)
if(OM_SANITIZE)
    set(OM_TEST_TIMEOUT 900)
endif()

# om_test_limits(NAME SECONDS [VARIABLE=VALUE...]): the hang limit of a test. It is processor time, twice SECONDS for
# the two workers of a test, and kept by the test itself (test_common.h, run_case.py): work beside it does not
# end it. The wall clock of CTest is for deadlocks only. Waiting threads do not spin. An emulator takes 10 to 40 times as long.
function(om_test_limits name seconds)
    if(CMAKE_CROSSCOMPILING_EMULATOR)
        math(EXPR seconds "20 * ${seconds}")
    endif()
    math(EXPR cpu "2 * ${seconds}")
    math(EXPR wall "6 * ${seconds}")
    set_tests_properties(${name} PROPERTIES TIMEOUT ${wall} SKIP_RETURN_CODE 77
        ENVIRONMENT "OM_TEST_CPU_S=${cpu};OMP_WAIT_POLICY=passive;OPENBLAS_THREAD_TIMEOUT=14;${ARGN}")
endfunction()

# Programs that only the check needs: the target `tests` builds them, the default target does not.
add_custom_target(tests)

# om_check_program(TARGET files...): a test program on the static library; private headers are in reach
# ("fem/fem_internal.h"). Tests run in debug-like flags: their own code is compiled once and runs little. With sanitizers
# half the time to compile a test at -O1 was spent on optimising it.
function(om_check_program target)
    add_executable(${target} EXCLUDE_FROM_ALL ${ARGN})
    add_dependencies(tests ${target})
    target_link_libraries(${target} PRIVATE omentum_static om_flags m)
    if(OM_SANITIZE)
        target_compile_options(${target} PRIVATE -O0)
    else()
        target_compile_options(${target} PRIVATE -O1)
    endif()
    target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/test)
endfunction()

# om_test(NAME file [LABELS label...] [TIMEOUT s] [PARTS n]): a file of cmocka tests. All files of a folder are one program,
# tests_<folder>; `tests_fem test_fem_energy` runs one file, as CTest does, from the source root. The main() of each
# file is renamed to its NAME, test_main.c calls it.
function(om_test name file)
    cmake_parse_arguments(ARG "" "TIMEOUT;PARTS" "LABELS" ${ARGN})
    get_filename_component(room ${CMAKE_CURRENT_SOURCE_DIR} NAME)
    set(program tests_${room})
    if(NOT TARGET ${program})
        om_check_program(${program} ${PROJECT_SOURCE_DIR}/test/test_main.c)
        target_link_libraries(${program} PRIVATE PkgConfig::CMOCKA)
        set(list ${CMAKE_CURRENT_BINARY_DIR}/${program}.h)
        file(GENERATE OUTPUT ${list} CONTENT "TEST($<JOIN:$<TARGET_PROPERTY:${program},OM_TESTS>,)\nTEST(>)\n")
        target_compile_definitions(${program} PRIVATE OM_TEST_LIST="${list}")
    endif()
    target_sources(${program} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    set_property(TARGET ${program} APPEND PROPERTY OM_TESTS ${name})
    set_source_files_properties(${file} PROPERTIES COMPILE_DEFINITIONS main=${name})
    add_test(NAME ${name} COMMAND ${program} ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    if(NOT ARG_TIMEOUT)
        set(ARG_TIMEOUT ${OM_TEST_TIMEOUT})
    endif()
    set(limits ${ARG_TIMEOUT} "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tools/tsan.supp")
    # a file with a case that lets allocations fail has the label of those (OM_TEST_CASES=memory runs only them)
    file(STRINGS ${file} memory REGEX "test_failing_allocations\\(")
    if(memory)
        list(APPEND ARG_LABELS memory)
    endif()
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS};room_${room}")
    om_test_limits(${name} ${limits})
    # with PARTS n the cases, which need nothing of each other, are dealt to NAME, NAME_2 ... NAME_n
    if(ARG_PARTS)
        om_test_limits(${name} ${limits} OM_TEST_PART=1/${ARG_PARTS})
        foreach(part RANGE 2 ${ARG_PARTS})
            add_test(NAME ${name}_${part} COMMAND ${program} ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
            set_tests_properties(${name}_${part} PROPERTIES LABELS "${ARG_LABELS};room_${room}")
            om_test_limits(${name}_${part} ${limits} OM_TEST_PART=${part}/${ARG_PARTS})
        endforeach()
    endif()
    # where a quick run leaves cases, sizes or repetitions out, NAME_all runs them all; where it lets only some
    # allocations fail, NAME_allocations lets each of them
    file(STRINGS ${file} all REGEX "test_is_slow\\(|test_count\\(|cmocka_slow_test\\(")
    file(STRINGS ${file} stride REGEX "test_stride\\(")
    set(environment OM_TEST_SLOW=1)
    if(all)
        set(slow ${name}_all)
    elseif(stride)
        set(slow ${name}_allocations)
        list(APPEND environment OM_TEST_CASES=memory)
    endif()
    if(slow)
        add_test(NAME ${slow} COMMAND ${program} ${name} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
        set_tests_properties(${slow} PROPERTIES LABELS "slow;room_${room}")
        om_test_limits(${slow} ${limits} ${environment})
    endif()
endfunction()

# om_program(TARGET NAME files...): build/<preset>/bin/NAME on the shared library's public headers. It finds
# the library beside it in the build tree, and in ../lib once installed, wherever that is.
function(om_program target name)
    add_executable(${target} ${ARGN})
    target_link_libraries(${target} PRIVATE omentum om_flags m)
    file(RELATIVE_PATH up /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
    set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name}
        RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin INSTALL_RPATH "$ORIGIN/${up}")
endfunction()

# om_fuzz(NAME file CORPUS folder COVERS source...): a fuzz target. Test replay_NAME runs it over its corpus, all targets in
# the one program `replay`, which knows each by its name; with OM_FUZZ build/fuzz/bin/NAME is the libFuzzer program, and
# fuzz_targets.txt says what it is to cover.
function(om_fuzz name file)
    cmake_parse_arguments(ARG "" "CORPUS" "COVERS" ${ARGN})
    set(corpus ${CMAKE_CURRENT_SOURCE_DIR}/${ARG_CORPUS})
    if(OM_FUZZ)
        add_executable(${name} ${file})
        set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
        target_link_options(${name} PRIVATE -fsanitize=fuzzer)
        target_link_libraries(${name} PRIVATE omentum_static om_flags m)
        target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src)
        string(JOIN " " covers ${ARG_COVERS})
        set_property(GLOBAL APPEND_STRING PROPERTY OM_FUZZ_TARGETS "${name} ${corpus} ${covers}\n")
        get_property(targets GLOBAL PROPERTY OM_FUZZ_TARGETS)
        file(WRITE ${PROJECT_BINARY_DIR}/fuzz_targets.txt "${targets}")
        return()
    endif()
    if(NOT TARGET replay)
        om_check_program(replay ${PROJECT_SOURCE_DIR}/fuzz/fuzz_replay.c)
        set(list ${CMAKE_CURRENT_BINARY_DIR}/replay.h)
        file(GENERATE OUTPUT ${list} CONTENT "TARGET($<JOIN:$<TARGET_PROPERTY:replay,OM_TARGETS>,)\nTARGET(>)\n")
        target_compile_definitions(replay PRIVATE OM_TARGET_LIST="${list}")
    endif()
    target_sources(replay PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/${file})
    set_property(TARGET replay APPEND PROPERTY OM_TARGETS ${name})
    set_source_files_properties(${file} PROPERTIES COMPILE_DEFINITIONS LLVMFuzzerTestOneInput=${name})
    add_test(NAME replay_${name} COMMAND replay ${name} ${corpus})
    set_tests_properties(replay_${name} PROPERTIES LABELS "fuzz;parser")
    om_test_limits(replay_${name} 120)
endfunction()
