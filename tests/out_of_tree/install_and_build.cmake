# Installs perikit, builds a plugin project against the installed tree alone, and asks the installed program for its part.
# Needs: build (perikit's build folder), source (this folder), work (scratch folder), compiler, libdir.
file(REMOVE_RECURSE ${work})
set(prefix ${work}/prefix)
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${build} --prefix ${prefix})
# A plugin that installation changed would not fit its manifest any more, and be opened without need.
set(cone ${libdir}/perikit/influence_cone.so)
run(${CMAKE_COMMAND} -E compare_files ${build}/${cone} ${prefix}/${cone})

run(${CMAKE_COMMAND} -S ${source}/plugin -B ${work}/plugin -G Ninja -D CMAKE_PREFIX_PATH=${prefix} -D CMAKE_CXX_COMPILER=${compiler}
    -D CMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${work}/plugin)
if(NOT EXISTS ${work}/plugin/parabola.parts)
  message(FATAL_ERROR "no manifest beside ${work}/plugin/parabola.so")
endif()

execute_process(COMMAND ${prefix}/bin/perikit list influence --plugin-path ${work}/plugin
                OUTPUT_VARIABLE parts COMMAND_ERROR_IS_FATAL ANY)
foreach(part parabola cone)
  if(NOT parts MATCHES ${part})
    message(FATAL_ERROR "the installed program does not list ${part}:\n${parts}")
  endif()
endforeach()
