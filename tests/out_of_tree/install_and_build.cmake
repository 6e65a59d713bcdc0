# Installs perikit, lets the installed program write a project of every kind that it has a template for, and does with each what its
# own_part.md says: build, contract, scene.
# Needs: build (perikit's build folder), work (scratch folder), compiler, libdir.
file(REMOVE_RECURSE ${work})
set(prefix ${work}/prefix)
set(ENV{CXX} ${compiler})
function(run)
  execute_process(COMMAND ${ARGV} WORKING_DIRECTORY ${work} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(must_contain text word)
  if(NOT text MATCHES "${word}")
    message(FATAL_ERROR "no '${word}' in:\n${text}")
  endif()
endfunction()

file(MAKE_DIRECTORY ${work})
run(${CMAKE_COMMAND} --install ${build} --prefix ${prefix})
# A plugin that installation changed would not fit its manifest any more, and be opened without need.
set(cone ${libdir}/perikit/influence_cone.so)
run(${CMAKE_COMMAND} -E compare_files ${build}/${cone} ${prefix}/${cone})

file(GLOB kinds RELATIVE ${prefix}/share/perikit/templates ${prefix}/share/perikit/templates/*)
list(REMOVE_ITEM kinds common)
list(LENGTH kinds count)
if(count LESS 6)
  message(FATAL_ERROR "templates of ${kinds} alone")
endif()
foreach(kind IN LISTS kinds)
  set(part my_${kind})
  set(library ${part}/build/${kind}_${part})
  run(${prefix}/bin/perikit new ${kind} ${part})
  run(${CMAKE_COMMAND} -S ${part} -B ${part}/build -G Ninja)
  run(${CMAKE_COMMAND} --build ${part}/build)
  if(NOT EXISTS ${work}/${library}.parts)
    message(FATAL_ERROR "no manifest beside ${library}.so")
  endif()
  run(${CMAKE_CTEST_COMMAND} --test-dir ${part}/build --output-on-failure --no-tests=error)
  file(READ ${work}/${part}/build/Testing/Temporary/LastTest.log report)
  must_contain("${report}" "kept:   ${kind}: ")
  if(kind STREQUAL stabilization)
    must_contain("${report}" "kept:   kinematics: linear and angular momentum")   # of what it stabilizes
  endif()
  execute_process(COMMAND ${prefix}/bin/perikit list ${kind} --plugin-path ${part}/build WORKING_DIRECTORY ${work}
                  OUTPUT_VARIABLE parts COMMAND_ERROR_IS_FATAL ANY)
  must_contain("${parts}" ${part})
  must_contain("${parts}" ".*\n.*\n")   # beside those of the installed tree
endforeach()
