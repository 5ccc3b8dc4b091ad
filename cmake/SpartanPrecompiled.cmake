# Precompiled headers: what nearly every file includes and what is slow to parse, once for the libraries, once for the
# tests and once for the program, because the flags differ. Configure with -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON to
# build without (scripts/lint does: a file must include what it uses).
set(SPARTAN_PRECOMPILED
  <algorithm> <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional> <span> <string>
  <string_view> <variant> <vector>
  <Eigen/Core> <Eigen/Geometry> <tl/expected.hpp> <fmt/format.h>)

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(spartan_flags INTERFACE -fpch-preprocess)  # for ccache
else()
  target_compile_options(spartan_flags INTERFACE "SHELL:-Xclang -fno-pch-timestamp")
endif()

# Code around the libraries, of the tests and the commands: optimizing it would only make the build slower.
add_library(spartan_glue_flags INTERFACE)
target_compile_options(spartan_glue_flags INTERFACE $<$<CONFIG:Release,RelWithDebInfo>:-O1>)

# spartan_precompiled(NAME LINKS libraries… HEADERS headers…): compiles the headers for targets to REUSE_FROM it.
function(spartan_precompiled name)
  cmake_parse_arguments(A "" "" "LINKS;HEADERS" ${ARGN})
  set(source ${CMAKE_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "")
  add_library(${name} OBJECT ${source})
  target_link_libraries(${name} PRIVATE spartan_flags ${A_LINKS} Eigen3::Eigen tl::expected fmt::fmt)
  target_precompile_headers(${name} PRIVATE ${SPARTAN_PRECOMPILED} ${A_HEADERS})
endfunction()

spartan_precompiled(spartan_precompiled_library)
set_target_properties(spartan_precompiled_library PROPERTIES POSITION_INDEPENDENT_CODE ON)
spartan_precompiled(spartan_precompiled_program LINKS spartan_glue_flags CLI11::CLI11 nlohmann_json::nlohmann_json
  HEADERS <CLI/CLI.hpp> <nlohmann/json.hpp>)
if(SPARTAN_TESTS)
  spartan_precompiled(spartan_precompiled_test LINKS spartan_glue_flags GTest::gmock rapidcheck
    HEADERS <gtest/gtest.h> <gmock/gmock.h> <rapidcheck/gtest.h>)
endif()
