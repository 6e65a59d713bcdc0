#!/usr/bin/env bash
# package.sh [LEVEL...]: builds perikit for levels of the x86-64 architecture (x86-64-v3, or those named) and packs them into build/package/*.deb for
# Debian 12. Each level is a whole build. CMAKE_ARGUMENTS: more options for each of them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
levels=("${@:-x86-64-v3}")
trees=()
for level in "${levels[@]}"; do
  case $level in
    x86-64-v[234]) ;;
    *) echo "package.sh: found the level '$level'; allowed: x86-64-v2, x86-64-v3, x86-64-v4" >&2; exit 2 ;;
  esac
  tree=$PWD/build/package/$level
  # shellcheck disable=SC2086
  cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPERIKIT_TESTS=OFF -DPERIKIT_NATIVE=OFF -DPERIKIT_LEVEL="$level" ${CMAKE_ARGUMENTS:-} > /dev/null
  cmake --build "$tree"
  trees+=("$tree")
done
cmake -B "${trees[0]}" -DPERIKIT_PACKAGE_TREES="$(IFS=';'; echo "${trees[*]:1}")" > /dev/null
(cd "${trees[0]}" && cpack -B ..)
rm -rf build/package/_CPack_Packages
ls build/package/*.deb
