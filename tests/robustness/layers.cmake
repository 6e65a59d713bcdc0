# Includes run downwards: a file reads headers of its own folder and of folders that come before it in `order`, which stands here and
# nowhere else. What is high may know what is low, never the other way round; so each folder can be read, tested and replaced with nothing
# but those below it. Public headers are those that parts need, and a folder is no longer than a screen.
# Needs: source (the repository).
#
cmake_minimum_required(VERSION 3.25)

# One name for the headers of include/perikit/<folder> and the sources of src/<folder>. "folder/file" and "folder/sub-folder" are placed apart.
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
    cloud_balance     # weights and shifts that balance a constant stress on clouds
    assembly          # the tangent as a matrix
    terms             # what adds to forces, energy and tangent
    fracture          # which bonds fail, when, and what that does
    problem           # state, constraints, loads
    output_fields     # fields of points by name
    sdk               # what parts are written with: laws, equilibrium, load steps
    plugin/registry   # makes parts of every kind, so it knows the interfaces of all of them
    scene             # what a file says
    output            # what is written
    fracture/limits   # limits of bonds, from a scene
    setup             # makes bodies, models and problems from scenes
    warnings          # what may be wrong in a scene, a body, a model
    run               # one run
    study             # many
    app)              # the command line

file(GLOB_RECURSE files ${source}/framework/src/*.?pp ${source}/framework/include/perikit/*.?pp ${source}/framework/app/*.?pp)
list(LENGTH files count)
if(count LESS 100)
  message(FATAL_ERROR "${count} files alone below ${source}/framework")
endif()

# The place of "folder/.../file.hpp" in the order.
function(place_of path variable)
  if(NOT path MATCHES "/")   # perikit/<kind>.hpp: what a part of that kind includes
    list(FIND order sdk place)
    set(${variable} ${place} PARENT_SCOPE)
    return()
  endif()
  string(REGEX REPLACE "\\.[a-z]+$" "" stem ${path})
  set(place -1)
  while(place LESS 0 AND stem)   # the file, else the innermost folder that has a place
    list(FIND order ${stem} place)
    string(REGEX REPLACE "/?[^/]+$" "" stem ${stem})
  endwhile()
  if(place LESS 0)
    message(FATAL_ERROR "${path}: the folder has no place in the order of tests/robustness/layers.cmake")
  endif()
  set(${variable} ${place} PARENT_SCOPE)
endfunction()

# A room whose folder is full has sub-folders.
set(folders "")
foreach(file IN LISTS files)
  cmake_path(GET file PARENT_PATH folder)
  string(MAKE_C_IDENTIFIER ${folder} name)
  list(APPEND files_of_${name} ${file})
  list(LENGTH files_of_${name} count)
  if(file MATCHES "/framework/src/" AND count EQUAL 28)
    list(APPEND full "${folder}")
  endif()
endforeach()
if(full)
  message(FATAL_ERROR "more than 27 files, make sub-folders: ${full}")
endif()

# Public headers are those that parts read, directly or by another one: the id of a build is a hash of them.
file(GLOB_RECURSE readers ${source}/plugins/*.?pp ${source}/materials/*.?pp ${source}/integrators/*.?pp ${source}/framework/templates/* ${source}/tests/out_of_tree/*.?pp)
set(read "")
while(readers)
  list(POP_FRONT readers reader)
  file(STRINGS ${reader} includes REGEX "^#include \"perikit/[^\"]+\"")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" header ${include})
    set(header ${source}/framework/include/${header})
    if(EXISTS ${header} AND NOT header IN_LIST read)
      list(APPEND read ${header})
      list(APPEND readers ${header})
    endif()
  endforeach()
endwhile()
file(GLOB_RECURSE public ${source}/framework/include/perikit/*.hpp)
list(REMOVE_ITEM public ${read})
if(public)
  list(JOIN public "\n  " lines)
  message(FATAL_ERROR "no part reads these headers, which belong beside their sources:\n  ${lines}")
endif()

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
