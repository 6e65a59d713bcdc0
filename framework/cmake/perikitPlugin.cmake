# perikit_compile_options(target): the flags that framework and plugins share (they must agree on the SIMD width).
function(perikit_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  # The same bits at every level and every optimisation (docs/decisions/0025-same-bits.md): products and sums are fused where the source says so
  # (perikit/core/simd.hpp), not where the compiler likes to, and Eigen sums in the order of scalars, whatever the width of a register is.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  target_compile_definitions(${target} PRIVATE EIGEN_DONT_VECTORIZE)
  # Parts are described with designated initializers, which leave out what has a default.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wno-missing-field-initializers -fno-math-errno -fno-trapping-math)
  if(PERIKIT_NATIVE)
    target_compile_options(${target} PRIVATE -march=native)
    target_compile_definitions(${target} PRIVATE PERIKIT_NATIVE)
  else()
    target_compile_options(${target} PRIVATE -march=${PERIKIT_LEVEL})
    # Rows of four doubles are vectors of the compiler. Without AVX it tells that code with AVX would pass them otherwise: parts and library are of one level.
    if(PERIKIT_LEVEL STREQUAL "x86-64-v2")
      target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>)
    endif()
  endif()
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    # A level is tuned for no processor: so it is tested. The loader of a machine that has not this level refuses what is linked here.
    if(NOT PERIKIT_NATIVE)
      target_link_options(${target} PRIVATE -Wl,-z,${PERIKIT_LEVEL})
    endif()
    target_compile_options(${target} PRIVATE -mprefer-vector-width=512)
    # Tensors are copied in whole registers. The default for levels of the architecture is half of one: what was written in one piece and is read
    # in two, or the other way about, makes the reader wait.
    target_compile_options(${target} PRIVATE
      $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,12>>:-mmove-max=512;-mstore-max=512>)
  endif()
  if(PERIKIT_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(PERIKIT_COUNT_OPERATIONS)
    target_compile_definitions(${target} PRIVATE PERIKIT_COUNT_OPERATIONS)
  endif()
  if(PERIKIT_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${PERIKIT_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PRIVATE -fsanitize=${PERIKIT_SANITIZE})
  endif()
endfunction()

# perikit_add_plugin(name sources...): a shared library that the registry can load, with its manifest beside it.
# PERIKIT_PLUGIN_OUTPUT, where set, is the folder that it is built into, and it is installed with the program.
function(perikit_add_plugin name)
  add_library(${name} MODULE ${ARGN})
  target_link_libraries(${name} PRIVATE perikit::perikit)
  # Every plugin asks the loader for its libperikit.so.<ABI>, even one that uses no symbol of it.
  target_link_options(${name} PRIVATE -Wl,-z,defs -Wl,--no-as-needed)
  perikit_compile_options(${name})
  if(TARGET perikit_part_headers)   # perikit's own parts
    target_precompile_headers(${name} REUSE_FROM perikit_part_headers)
  endif()
  # Built with the rpath it is installed with: an installed plugin is byte for byte the one that its manifest was written for.
  set_target_properties(${name} PROPERTIES PREFIX "" SUFFIX ".so" CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
                        BUILD_WITH_INSTALL_RPATH ON INSTALL_RPATH "$ORIGIN/.." INSTALL_RPATH_USE_LINK_PATH ON)
  if(PERIKIT_PLUGIN_OUTPUT)
    set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${PERIKIT_PLUGIN_OUTPUT})
    install(TARGETS ${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/perikit)
    install(FILES ${PERIKIT_PLUGIN_OUTPUT}/${name}.parts DESTINATION ${CMAKE_INSTALL_LIBDIR}/perikit)
  endif()
  add_custom_command(TARGET ${name} POST_BUILD COMMAND perikit::perikit-manifest $<TARGET_FILE:${name}> VERBATIM)
endfunction()
