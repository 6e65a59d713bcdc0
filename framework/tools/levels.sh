#!/usr/bin/env bash
# levels.sh FOLDER LEVEL...: builds perikit for each level of the x86-64 architecture in FOLDER/LEVEL, and runs with each build `perikit check --machine` and the
# tests of packs, laws, bonds, stencils and the contracts of kinematics. CXX, CC, LAUNCHER: compilers, and what starts them. CMAKE_ARGUMENTS: more options for CMake.
set -euo pipefail
folder=$(realpath -m "${1:?levels.sh FOLDER LEVEL...}")
shift
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export OMP_WAIT_POLICY=passive
for level in "$@"; do
  tree=$folder/$level
  # shellcheck disable=SC2086
  cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPERIKIT_TESTS=ON -DPERIKIT_NATIVE=OFF -DPERIKIT_LEVEL="$level" \
        ${LAUNCHER:+-DCMAKE_C_COMPILER_LAUNCHER=$LAUNCHER -DCMAKE_CXX_COMPILER_LAUNCHER=$LAUNCHER} ${CMAKE_ARGUMENTS:-} > /dev/null
  cmake --build "$tree" --target perikit-program parts perikit_unit perikit_contract third_party
  "$tree/bin/perikit" check --machine
  ctest --test-dir "$tree" -j 2 --output-on-failure --no-tests=error \
        -R '^unit\.(simd|simd_math|stretch|stencils|laws|materials|laminate|selective_map|row_packs|families)$|^contract\.(kinematics|stabilization|third_party)'
  echo "$level: right"
done
