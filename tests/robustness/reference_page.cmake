# Fails where the reference page in the repository is not what the program would write.
unset(ENV{PERIKIT_PLUGIN_PATH})
execute_process(COMMAND ${program} describe --markdown OUTPUT_VARIABLE now COMMAND_ERROR_IS_FATAL ANY)
file(READ ${page} stored)
if(NOT now STREQUAL stored)
  message(FATAL_ERROR "${page} is stale; write it anew with\n  ninja reference_page\nor\n  ${program} describe --markdown > ${page}")
endif()
