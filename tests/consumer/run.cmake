# Installs BUILD to a fresh prefix under WORK, then configures, builds and runs the consumer projects against it, from
# copies of the installed example, so that nothing but the installed files can help.
set(prefix "${WORK}/prefix")
file(REMOVE_RECURSE "${WORK}")

file(READ "${CMAKE_CURRENT_LIST_DIR}/../../README.md" readme)
if(NOT readme MATCHES "```cpp\n([^`]*)```")
  message(FATAL_ERROR "README.md has no C++ example")
endif()
file(WRITE "${WORK}/source/readme.cpp" "${CMAKE_MATCH_1}")

file(READ "${CMAKE_CURRENT_LIST_DIR}/../../docs/tutorials/library.md" tutorial)
if(NOT tutorial MATCHES "```cpp\n(#include[^`]*)```")
  message(FATAL_ERROR "docs/tutorials/library.md has no program with a frame source")
endif()
file(WRITE "${WORK}/source/stream.cpp" "${CMAKE_MATCH_1}")

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
# build(SOURCE FOLDER arguments…): configures and builds a project.
function(build source folder)
  run("${CMAKE_COMMAND}" -S "${source}" -B "${folder}" -G Ninja "-DCMAKE_PREFIX_PATH=${prefix}"
    -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}" ${ARGN})
  run("${CMAKE_COMMAND}" --build "${folder}")
endfunction()

run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${prefix}")
file(COPY "${prefix}/share/doc/spartan/example/" DESTINATION "${WORK}/source")
build("${WORK}/source" "${WORK}/build")
run("${WORK}/build/consumer")
run("${WORK}/build/stream" "${WORK}/stream_run")
foreach(file IN ITEMS summary.json trajectory_odometry.tum live/1/frames.csv)
  if(NOT EXISTS "${WORK}/stream_run/${file}")
    message(FATAL_ERROR "the frame source of docs/tutorials/library.md leads to no ${file}")
  endif()
endforeach()
run("${prefix}/bin/spartan" --help)

foreach(file IN ITEMS doc/spartan/LICENSE bash-completion/completions/spartan zsh/site-functions/_spartan
    fish/vendor_completions.d/spartan.fish man/man1/spartan.1)
  if(NOT EXISTS "${prefix}/share/${file}")
    message(FATAL_ERROR "share/${file} is not installed")
  endif()
endforeach()

# Camera models alone: none of these packages may be needed.
set(hidden)
foreach(package OpenCV PNG GDAL SQLite3 embree libjpeg-turbo hwy nlohmann_json)
  list(APPEND hidden "-DCMAKE_DISABLE_FIND_PACKAGE_${package}=TRUE")
endforeach()
build("${WORK}/source/rig" "${WORK}/build_rig" ${hidden})
run("${WORK}/build_rig/rig_consumer" "${prefix}/share/spartan/config/rigs/euroc.yaml")

file(GLOB_RECURSE headers "${prefix}/include/*.h")
list(LENGTH headers count)
message(STATUS "${count} installed headers")
if(count GREATER 60)
  message(FATAL_ERROR "at most 60 headers may be installed; move what no user needs to internal/")
endif()
file(GLOB_RECURSE intruders "${prefix}/*_test*" "${prefix}/*/testing/*" "${prefix}/lib/*testing*"
  "${prefix}/include/*/internal/*" "${prefix}/include/*/numerics/*")
if(intruders)
  message(FATAL_ERROR "tests, their library and internal headers must not be installed: ${intruders}")
endif()
