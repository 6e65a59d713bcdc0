# The scenes beside this file with three threads, under the thread sanitizer: explicit steps of every kinematics on lattices and clouds, with bonds
# that fail, and every quasi-static integrator; then what the contract suites say of several threads. A race ends the run.
# Needs: program, contract (the suites), work (scratch folder).
file(REMOVE_RECURSE ${work})
file(MAKE_DIRECTORY ${work})
set(ENV{OMP_WAIT_POLICY} passive)
set(ENV{OPENBLAS_NUM_THREADS} 1)   # its own threads are not built with the sanitizer,
set(ENV{OMP_THREAD_LIMIT} 1)       # nor are those of CHOLMOD; perikit's are no OpenMP threads here
set(ENV{TSAN_OPTIONS} "halt_on_error=1 exitcode=66")
set(scenes ${CMAKE_CURRENT_LIST_DIR})
function(clean name)
  message(STATUS "races: ${name}")
  execute_process(COMMAND ${program} run ${ARGN} -o ${name} --threads 3 WORKING_DIRECTORY ${work} RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE out)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${name}: exit status ${status}\n${out}")
  endif()
endfunction()

set(larger --set "body.lattice.upper=[100, 50]" --set integrator.end_time=0.3)   # several blocks of every loop
foreach(kinematics conventional baqp projection bond_augmented non_spherical sub_horizon bond_associated bond_based ordinary selective)
  set(type "kinematics={type=\"${kinematics}\"}")
  if(kinematics STREQUAL selective)
    set(type "kinematics={type=\"selective\",base={type=\"bond_associated\"}}")
  endif()
  set(fields)
  if(kinematics MATCHES "bond_based|ordinary")
    set(fields --set "output.fields=[\"displacement\", \"internal_force\", \"strain_energy_density\"]")   # pair laws have no stresses
  endif()
  clean(${kinematics}_lattice ${scenes}/explicit.toml --set ${type} ${larger} ${fields})
  clean(${kinematics}_cloud ${scenes}/explicit.toml --set ${type} ${larger} ${fields} --set body.lattice.jitter=0.1)
endforeach()
foreach(stabilization silling wan)
  clean(${stabilization} ${scenes}/explicit.toml --set "kinematics={type=\"conventional\",stabilization=\"${stabilization}\"}" ${larger})
endforeach()
foreach(solver newton jfnk kinsol dynamic_relaxation)
  clean(${solver} ${scenes}/quasi_static.toml --set integrator.type=${solver} --set "body.lattice.upper=[14, 6, 6]")
endforeach()
# Other kinematics share these loops; under the sanitizer their suites take half an hour each.
foreach(part integrator/verlet integrator/newton integrator/jfnk integrator/kinsol integrator/dynamic_relaxation kinematics/conventional
        kinematics/bond_based kinematics/ordinary)
  message(STATUS "races: suites of ${part}")
  execute_process(COMMAND ${contract} --parts=${part} "--test-case=*threads*" --no-skipped-summary COMMAND_ERROR_IS_FATAL ANY)
endforeach()
