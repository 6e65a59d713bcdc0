# Fails where the program, the framework or a part needs a library of MPI or PETSc.
# Needs: program, core, parts (a folder).
file(GLOB libraries ${parts}/*.so)
list(LENGTH libraries count)
if(count LESS 10)
  message(FATAL_ERROR "${count} parts alone in ${parts}")
endif()
foreach(file ${program} ${core} ${libraries})
  execute_process(COMMAND ldd ${file} OUTPUT_VARIABLE needed COMMAND_ERROR_IS_FATAL ANY)
  if(needed MATCHES "lib(mpi|mpich|open-rte|open-pal|petsc|hypre)[^ ]*\\.so")
    message(FATAL_ERROR "${file} needs ${CMAKE_MATCH_0}")
  endif()
endforeach()
message(STATUS "${count} parts, program and framework need neither MPI nor PETSc")
