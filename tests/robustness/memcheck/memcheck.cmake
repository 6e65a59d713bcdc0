# Memory errors of the optimised program, which the sanitizers' builds are not: runs of the scenes beside this file, going on from a checkpoint,
# and opening every library of parts, the good ones and those that must be refused. Any error, and any block that is lost for sure, fails.
# Needs: valgrind, program, bad (folder of libraries that must be refused), work (scratch folder).
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work})
set(ENV{OMP_WAIT_POLICY} passive)          # else the program starts itself again
set(ENV{OPENBLAS_CORETYPE} Nehalem)        # no instructions that valgrind lacks
set(checker ${valgrind} --quiet --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite --show-leak-kinds=definite
    --suppressions=${CMAKE_CURRENT_LIST_DIR}/known.supp)
function(checked name)
  message(STATUS "memcheck: ${name}")
  execute_process(COMMAND ${checker} --log-file=${work}/${name}.log ${ARGN} WORKING_DIRECTORY ${work} RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE out)
  file(READ ${work}/${name}.log found)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${name}: exit status ${status}\n${out}\n${found}")
  endif()
endfunction()

foreach(solver newton jfnk kinsol)
  checked(${solver} ${program} run ${CMAKE_CURRENT_LIST_DIR}/quasi_static.toml -o ${solver} --threads 1 --set integrator.type=${solver})
endforeach()
checked(explicit ${program} run ${CMAKE_CURRENT_LIST_DIR}/explicit.toml -o explicit --threads 2)
checked(resume ${program} run ${CMAKE_CURRENT_LIST_DIR}/explicit.toml -o explicit --threads 2 --resume)
checked(describe ${program} describe --markdown)
file(GLOB folders ${bad}/*)
foreach(folder IN LISTS folders)
  cmake_path(GET folder FILENAME name)
  checked(list_${name} ${program} list --plugin-path ${folder})
endforeach()
