# Installs BUILD to a fresh prefix under WORK, then configures, builds and runs the consumer project against it,
# from a copy of its sources, so that nothing but the installed files can help.
set(prefix "${WORK}/prefix")
set(source "${WORK}/source")
file(REMOVE_RECURSE "${WORK}")
file(COPY "${CMAKE_CURRENT_LIST_DIR}/CMakeLists.txt" "${CMAKE_CURRENT_LIST_DIR}/main.cpp" DESTINATION "${source}")

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${prefix}")
run("${CMAKE_COMMAND}" -S "${source}" -B "${WORK}/build" -G Ninja "-DCMAKE_PREFIX_PATH=${prefix}"
  -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}")
run("${CMAKE_COMMAND}" --build "${WORK}/build")
run("${WORK}/build/consumer")
run("${prefix}/bin/spartan" --help)

file(GLOB_RECURSE intruders "${prefix}/*_test*" "${prefix}/*/testing/*" "${prefix}/lib/*testing*")
if(intruders)
  message(FATAL_ERROR "tests and their library must not be installed: ${intruders}")
endif()
