# Writes OUTPUT from version.cpp.in, with the commit that is checked out; only if it has changed.
# A release that was unpacked inside another repository has no commit of its own.
execute_process(COMMAND git -C ${SOURCE} rev-parse --show-toplevel OUTPUT_VARIABLE top
  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
file(REAL_PATH ${SOURCE} source)
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=9 --match "" OUTPUT_VARIABLE commit
  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed OR NOT commit OR NOT top STREQUAL source)
  set(commit unknown)
endif()
configure_file(${SOURCE}/src/program/version.cpp.in ${OUTPUT} @ONLY)
