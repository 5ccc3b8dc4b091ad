# One function makes a module of src/spartan: its library, its tests, and the links it is allowed.

add_library(spartan_flags INTERFACE)
# -Wsubobject-linkage tells unnamed namespaces in headers; in a unity build GCC takes the sources for headers. The test
# include_graph refuses unnamed namespaces in headers instead.
# GCC 12 warns of overlaps, overflows and bounds inside std::string where there are none (its bug 105651:
# "text" + std::string); the last are warnings only, because outside of std::string they are worth reading.
target_compile_options(spartan_flags INTERFACE
  -Wall -Wextra -Wconversion -Wshadow -ffp-contract=off
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-stringop-overflow>
  $<$<AND:$<BOOL:${CMAKE_UNITY_BUILD}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage>
  $<$<BOOL:${SPARTAN_WERROR}>:-Werror>
  $<$<AND:$<BOOL:${SPARTAN_WERROR}>,$<CXX_COMPILER_ID:GNU>>:-Wno-error=array-bounds>)
# Builds in other folders give the same bytes.
target_compile_options(spartan_flags INTERFACE
  $<$<CONFIG:Release>:-ffile-prefix-map=${PROJECT_SOURCE_DIR}/=>)
# Highway leaves out AVX-512 with VPOPCNTB and VBMI (Ice Lake, Zen 4) unless it is asked for it.
target_compile_definitions(spartan_flags INTERFACE HWY_WANT_AVX3_DL)
# On ARM the kernels are those of NEON: structures of them hold vectors, which SVE does not allow, and GCC inlines the
# vectors' constructors only where the whole file may use what Highway asks for. It uses no cryptographic instruction.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  target_compile_options(spartan_flags INTERFACE -march=armv8-a+crypto)
  target_compile_definitions(spartan_flags INTERFACE
    "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()
if(SPARTAN_SANITIZE)
  target_compile_options(spartan_flags INTERFACE -fsanitize=${SPARTAN_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=undefined)
  if(SPARTAN_SANITIZE_EXCEPT)
    target_compile_options(spartan_flags INTERFACE -fno-sanitize=${SPARTAN_SANITIZE_EXCEPT})
  endif()
  target_link_options(spartan_flags INTERFACE -fsanitize=${SPARTAN_SANITIZE})
endif()
if(SPARTAN_COVERAGE)
  # Counters that threads share: without atomic additions gcov derives negative counts of branches.
  target_compile_options(spartan_flags INTERFACE --coverage -fprofile-update=atomic)
  target_link_options(spartan_flags INTERFACE --coverage)
endif()

if(SPARTAN_TESTS)
  find_package(GTest REQUIRED)
  include(GoogleTest)
  find_package(rapidcheck CONFIG REQUIRED)
endif()
include(SpartanPrecompiled)

# In a unity build (CMAKE_UNITY_BUILD, as most presets have it) several sources of a target are compiled as one file, which
# halves the time; the names in their unnamed namespaces must differ. Kernels that Highway compiles once for each
# instruction set stay files of their own.
function(spartan_exclude_from_unity)
  foreach(source IN LISTS ARGN)
    file(STRINGS ${source} kernels REGEX "foreach_target\\.h" LIMIT_COUNT 1)
    if(kernels)
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
  endforeach()
endfunction()

# spartan_test(NAME SOURCES … LINKS … [LABEL fast|long] [TIMEOUT s] [FIXTURE name])
function(spartan_test name)
  cmake_parse_arguments(A "" "LABEL;TIMEOUT;FIXTURE" "SOURCES;LINKS" ${ARGN})
  if(NOT A_LABEL)
    set(A_LABEL fast)
  endif()
  if(NOT A_TIMEOUT AND SPARTAN_COVERAGE)
    set(A_TIMEOUT 1200)  # a suite that is ended leaves no counts
  elseif(NOT A_TIMEOUT)
    set(A_TIMEOUT 300)
  endif()
  add_executable(${name} ${A_SOURCES})
  target_link_libraries(${name} PRIVATE spartan_flags spartan_glue_flags ${A_LINKS} GTest::gmock GTest::gtest_main rapidcheck)
  target_precompile_headers(${name} REUSE_FROM spartan_precompiled_test)
  target_include_directories(${name} SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
  set(fixture)
  if(A_FIXTURE)
    set(fixture FIXTURES_REQUIRED ${A_FIXTURE})
  endif()
  set(properties LABELS ${A_LABEL} TIMEOUT ${A_TIMEOUT} ${fixture}
    ENVIRONMENT "SPARTAN_SOURCE_DIR=${PROJECT_SOURCE_DIR}"  # the discovery tears a list of two apart
    ENVIRONMENT_MODIFICATION "SPARTAN_PROGRAM=set:${CMAKE_BINARY_DIR}/bin/spartan")
  if(SPARTAN_TEST_BY_SUITE AND NOT A_FIXTURE)
    spartan_add_suites(${name} SOURCES ${A_SOURCES} PROPERTIES ${properties})
  else()
    gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES ${properties})
  endif()
endfunction()

# One test of CTest for each test suite in the sources.
function(spartan_add_suites name)
  cmake_parse_arguments(A "" "" "SOURCES;PROPERTIES" ${ARGN})
  set(suites)
  foreach(source IN LISTS A_SOURCES)
    file(STRINGS ${source} tests REGEX "^(TEST|TEST_F|TEST_P|TYPED_TEST|RC_GTEST_PROP|RC_GTEST_FIXTURE_PROP)\\(")
    list(TRANSFORM tests REPLACE "^[A-Z_]+\\(([A-Za-z0-9_]+).*" "\\1")
    list(APPEND suites ${tests})
  endforeach()
  list(REMOVE_DUPLICATES suites)
  foreach(suite IN LISTS suites)
    add_test(NAME ${suite} COMMAND ${name} --gtest_filter=${suite}.*:${suite}/*:*/${suite}.*:*/${suite}/*)
    set_tests_properties(${suite} PROPERTIES ${A_PROPERTIES})
  endforeach()
endfunction()

# spartan_module(NAME USES modules… PUBLIC libraries… PRIVATE libraries… TEST_LIBRARIES libraries…)
# Sources are all x.cpp of src/spartan/NAME and its folders; x_test.cpp beside them become the tests of the module.
# Files named x_long_test.cpp carry the label `long` and run by request only.
function(spartan_module name)
  cmake_parse_arguments(A "" "" "USES;PUBLIC;PRIVATE;TEST_LIBRARIES" ${ARGN})
  set(folder ${PROJECT_SOURCE_DIR}/src/spartan/${name})
  file(GLOB_RECURSE all CONFIGURE_DEPENDS ${folder}/*.cpp)
  set(sources ${all})
  list(FILTER sources EXCLUDE REGEX "_test\\.cpp$")
  set(tests ${all})
  list(FILTER tests INCLUDE REGEX "_test\\.cpp$")
  set(long_tests ${tests})
  list(FILTER tests EXCLUDE REGEX "_long_test\\.cpp$")
  list(FILTER long_tests INCLUDE REGEX "_long_test\\.cpp$")

  set(target spartan_${name})
  if(sources)
    spartan_exclude_from_unity(${sources})
    set(scope PUBLIC)
    set(hidden PRIVATE)
    add_library(${target} STATIC ${sources})
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    if(opencv_core IN_LIST A_PUBLIC OR opencv_core IN_LIST A_PRIVATE OR image_io IN_LIST A_USES)
      target_include_directories(${target} SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
    endif()
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:spartan_flags>)
    target_precompile_headers(${target} REUSE_FROM spartan_precompiled_library)
  else()
    set(scope INTERFACE)
    set(hidden INTERFACE)
    add_library(${target} INTERFACE)
  endif()
  add_library(spartan::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(${target} ${scope}
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(${target} ${scope} cxx_std_20)
  foreach(used ${A_USES})
    target_link_libraries(${target} ${scope} spartan_${used})
  endforeach()
  target_link_libraries(${target} ${scope} ${A_PUBLIC})
  target_link_libraries(${target} ${hidden} ${A_PRIVATE})
  set_property(GLOBAL APPEND PROPERTY SPARTAN_MODULES ${name})
  set_property(GLOBAL PROPERTY SPARTAN_USES_${name} ${A_USES})
  set_property(GLOBAL PROPERTY SPARTAN_LIBRARIES_${name} ${A_PUBLIC} ${A_PRIVATE})

  if(SPARTAN_TESTS AND tests)
    spartan_test(${target}_test SOURCES ${tests} LINKS ${target} spartan_testing ${A_TEST_LIBRARIES} ${A_PRIVATE})
  endif()
  if(SPARTAN_TESTS AND long_tests)
    spartan_test(${target}_long_test SOURCES ${long_tests} LINKS ${target} spartan_testing ${A_TEST_LIBRARIES} ${A_PRIVATE}
      LABEL long TIMEOUT 3600)
  endif()
endfunction()

# spartan_plugin(NAME SOURCE LIBRARIES…)
# A library that is loaded only where it is needed, because of what it links (camera/internal/plugin_library.h).
function(spartan_plugin name source)
  add_library(${name} MODULE ${source})
  set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}
    CXX_VISIBILITY_PRESET default)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(${name} PRIVATE spartan_flags ${ARGN})
  install(TARGETS ${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/spartan COMPONENT cameras)
endfunction()
