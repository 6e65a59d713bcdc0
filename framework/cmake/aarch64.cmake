# For Debian's cross compiler and qemu-user, with the libraries for arm64 in CMAKE_SYSROOT: framework/tools/aarch64.sh, which gives that folder.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64;-L;${CMAKE_SYSROOT})
# The compiler wrappers of HDF5 and MPI that are found would be this machine's.
set(HDF5_C_COMPILER_EXECUTABLE /bin/false CACHE FILEPATH "")
set(CMAKE_DISABLE_FIND_PACKAGE_MPI ON)
