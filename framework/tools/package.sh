#!/usr/bin/env bash
# package.sh [LEVEL...]: builds perikit for levels of the x86-64 architecture (all that this machine can run, or those named) and packs them into
# build/package/*.deb for Debian 12. Each level is a whole build. CMAKE_ARGUMENTS: more options for each of them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
mapfile -t runs < <(/lib64/ld-linux-x86-64.so.2 --help | sed -n 's/^  \(x86-64-v[234]\) (supported.*/\1/p' | sort)
levels=("${@:-${runs[@]}}")
trees=()
for level in "${levels[@]}"; do
  case $level in
    x86-64-v[234]) ;;
    *) echo "package.sh: found the level '$level'; allowed: x86-64-v2, x86-64-v3, x86-64-v4" >&2; exit 2 ;;
  esac
  if [[ " ${runs[*]} " != *" $level "* ]]; then
    echo "package.sh: this machine cannot run $level, and a build runs its own program; allowed here: ${runs[*]}" >&2
    exit 2
  fi
  tree=$PWD/build/package/$level
  # shellcheck disable=SC2086
  cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPERIKIT_TESTS=OFF -DPERIKIT_NATIVE=OFF -DPERIKIT_LEVEL="$level" ${CMAKE_ARGUMENTS:-} > /dev/null
  cmake --build "$tree"
  "$tree/bin/perikit" check --machine
  trees+=("$tree")
done
if [[ $# -eq 0 && ${#runs[@]} -lt 3 ]]; then echo "package.sh: no build for $(printf 'x86-64-v%s ' $(seq $((${#runs[@]} + 2)) 4)), which this machine cannot run"; fi
cmake -B "${trees[0]}" -DPERIKIT_PACKAGE_TREES="$(IFS=';'; echo "${trees[*]:1}")" > /dev/null
(cd "${trees[0]}" && cpack -B ..)
rm -rf build/package/_CPack_Packages
ls build/package/*.deb
