# Writes OUTPUT from version.cpp.in, with the commit that is checked out; only if it has changed.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=9 --match "" OUTPUT_VARIABLE commit
  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed OR NOT commit)
  set(commit unknown)
endif()
configure_file(${SOURCE}/src/program/version.cpp.in ${OUTPUT} @ONLY)
