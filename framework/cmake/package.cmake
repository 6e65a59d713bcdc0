# `cpack` in a build folder makes a package for Debian 12 with this build and those of PERIKIT_PACKAGE_TREES, each complete in
# /usr/lib/perikit/<level>, and /usr/bin/perikit, which starts the best one that the processor can run. framework/tools/package.sh builds several.
set(PERIKIT_PACKAGE_TREES "" CACHE STRING "Build folders of other levels that cpack packs too")
if(PERIKIT_NATIVE)
  set(level native)   # of the machine that it was built on
else()
  set(level ${PERIKIT_LEVEL})
endif()
file(WRITE ${CMAKE_BINARY_DIR}/package/level "${level}")
set(projects "${CMAKE_BINARY_DIR};perikit;ALL;/usr/lib/perikit/${level}")
set(levels ${level})
foreach(tree IN LISTS PERIKIT_PACKAGE_TREES)
  file(READ ${tree}/package/level other)
  list(APPEND projects "${tree};perikit;ALL;/usr/lib/perikit/${other}")
  list(APPEND levels ${other})
endforeach()

# What all levels share.
set(common ${CMAKE_BINARY_DIR}/package/common)
file(REMOVE_RECURSE ${common})
file(COPY ${CMAKE_CURRENT_LIST_DIR}/../tools/launcher.sh DESTINATION ${common}/bin FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
     WORLD_READ WORLD_EXECUTE)
file(RENAME ${common}/bin/launcher.sh ${common}/bin/perikit)
file(COPY ${CMAKE_CURRENT_LIST_DIR}/../python/perikit DESTINATION ${common}/lib/python3/dist-packages PATTERN __pycache__ EXCLUDE)
file(COPY ${CMAKE_SOURCE_DIR}/configs/quickstart.toml ${CMAKE_SOURCE_DIR}/configs/tutorial DESTINATION ${common}/share/doc/perikit/configs)
file(COPY ${CMAKE_CURRENT_LIST_DIR}/../LICENSE DESTINATION ${common}/share/doc/perikit)
file(RENAME ${common}/share/doc/perikit/LICENSE ${common}/share/doc/perikit/copyright)

list(JOIN levels ", " level_names)
set(CPACK_GENERATOR DEB)
set(CPACK_INSTALL_CMAKE_PROJECTS ${projects})
set(CPACK_INSTALLED_DIRECTORIES ${common} /usr)
set(CPACK_PACKAGING_INSTALL_PREFIX /)   # the folders above are whole
set(CPACK_PACKAGE_NAME perikit)
set(CPACK_PACKAGE_VENDOR perikit)
set(CPACK_PACKAGE_CONTACT "perikit")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Correspondence peridynamics from parts that are loaded at run time")
set(CPACK_PACKAGE_DESCRIPTION "Kinematics, materials, integrators and damage criteria are shared libraries; a TOML file puts them together into a run. Built for ${level_names}.")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_LIBRARY_OUTPUT_DIRECTORY})
set(CPACK_DEBIAN_PACKAGE_DEPENDS "gnuplot-nox")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-h5py, python3-numpy, g++, cmake, libfmt-dev, libeigen3-dev")
set(CPACK_STRIP_FILES OFF)   # a library of parts is byte for byte the one that its manifest was written for
include(CPack)
