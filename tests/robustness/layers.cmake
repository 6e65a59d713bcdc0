# Includes run downwards: a file reads headers of its own folder and of folders that come before it in `order`, which stands here and
# nowhere else. What is high may know what is low, never the other way round; so each folder can be read, tested and replaced with nothing
# but those below it.
# Needs: source (the repository).
#
# One name for the headers of include/perikit/<folder> and the sources of src/<folder>. "folder/file" places single files apart.
set(order
    core              # memory, threads, vectors of numbers, errors
    files             # files that appear whole, HDF5
    plugin            # parameter tables, descriptions of parts, manifests, libraries
    model             # what a part of each kind must be
    body              # points, cracks, partition
    families          # who is in whose family, and which bonds are whole
    operators/laws    # stresses and tangents of a batch of points, across the laws of a body: what maps know of operators
    maps              # what a scene puts over a kinematics
    operators         # forces, tangents, energies, samples, history
    spaces            # evaluation points; they hand their batches to the operators
    assembly          # the tangent as a matrix
    terms             # what adds to forces, energy and tangent
    problem           # state, constraints, loads
    fields            # fields of points by name
    sdk               # what parts are written with: laws, equilibrium, load steps
    plugin/registry   # makes parts of every kind, so it knows the interfaces of all of them
    scene             # what a file says
    output            # what is written
    build             # makes bodies, models and problems from scenes
    run               # runs and studies
    app)              # the command line

file(GLOB_RECURSE files ${source}/framework/src/*.?pp ${source}/framework/include/perikit/*.?pp ${source}/framework/app/*.?pp)
list(LENGTH files count)
if(count LESS 100)
  message(FATAL_ERROR "${count} files alone below ${source}/framework")
endif()

# The place of "folder/.../file.hpp" in the order.
function(place_of path variable)
  string(REGEX MATCH "^[^/]+" folder ${path})
  string(REGEX REPLACE "\\.[a-z]+$" "" stem ${path})
  list(FIND order ${stem} place)
  if(place LESS 0)
    list(FIND order ${folder} place)
  endif()
  if(place LESS 0)
    message(FATAL_ERROR "${path}: the folder has no place in the order of tests/robustness/layers.cmake")
  endif()
  set(${variable} ${place} PARENT_SCOPE)
endfunction()

set(upwards "")
foreach(file IN LISTS files)
  string(REGEX REPLACE "^${source}/framework/(src/|include/perikit/)?" "" path ${file})
  place_of(${path} own)
  file(STRINGS ${file} includes REGEX "^#include \"[^\"]+/[^\"]+\"")   # a name without a folder lies beside the file
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "^#include \"(perikit/)?([^\"]+)\".*" "\\2" header ${include})
    place_of(${header} other)
    if(other GREATER own)
      list(APPEND upwards "${path} includes ${header}")
    endif()
  endforeach()
endforeach()
if(upwards)
  list(JOIN upwards "\n  " lines)
  message(FATAL_ERROR "these includes run upwards:\n  ${lines}")
endif()
