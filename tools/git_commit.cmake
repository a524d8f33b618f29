# Writes the commit of the sources to OUTPUT as a macro, and touches the file only when it changes.
#   cmake -DSOURCE_DIR=... -DOUTPUT=... -P git_commit.cmake
cmake_minimum_required(VERSION 3.25)

set(commit "")
find_program(git git)
if(git AND EXISTS ${SOURCE_DIR}/.git)
  # Does not use `describe --dirty`, which locks the index: a commit made during a build would fail.
  execute_process(COMMAND ${git} -C ${SOURCE_DIR} describe --always
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  execute_process(COMMAND ${git} -C ${SOURCE_DIR} --no-optional-locks status --porcelain --untracked-files=no
    OUTPUT_VARIABLE changes ERROR_QUIET)
  if(commit AND changes)
    string(APPEND commit "-dirty")
  endif()
endif()
if(NOT commit)
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define BRISTLE_GIT_COMMIT \"@commit@\"\n" @ONLY)
