#!/usr/bin/env bash
# Builds perikit for aarch64 with Debian's cross compiler and runs the unit tests, the contracts of all laws and of two kinematics under
# emulation, in build/aarch64. Needs, on Debian 12, the packages of setup.sh, g++-aarch64-linux-gnu and qemu-user; no root and no binfmt.
# The libraries for arm64 are unpacked into build/aarch64/sysroot (230 MB to fetch), this machine's packages stay as they are.
#   aarch64.sh [TESTS]      TESTS: a regular expression of other tests (ctest -R)
# CMAKE_ARGUMENTS: more options for CMake.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
tests=${1:-'^unit\.|^contract\.material\.|^contract\.kinematics\.(baqp|conventional)$'}
tree=$PWD/build/aarch64
sysroot=$tree/sysroot
for program in aarch64-linux-gnu-g++ qemu-aarch64; do
  command -v $program > /dev/null || { echo "aarch64.sh: no $program; apt-get install g++-aarch64-linux-gnu qemu-user" >&2; exit 1; }
done

if [[ ! -e $sysroot/complete ]]; then
  apt=$tree/apt
  rm -rf "$sysroot" "$apt"
  mkdir -p "$sysroot" "$apt/state/lists/partial" "$apt/cache/archives/partial"
  : > "$apt/status"
  echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian bookworm main" > "$apt/sources.list"
  cat > "$apt/apt.conf" << END
APT::Architecture "arm64";
APT::Architectures { "arm64"; };
APT::Sandbox::User "root";
Dir::State "$apt/state";
Dir::State::status "$apt/status";
Dir::Cache "$apt/cache";
Dir::Etc::sourcelist "$apt/sources.list";
Dir::Etc::sourceparts "-";
END
  export APT_CONFIG=$apt/apt.conf
  apt-get -q update
  apt-get -qq -y --download-only --no-install-recommends install libeigen3-dev libboost-dev libtomlplusplus-dev libsundials-dev libhdf5-dev \
    libfmt-dev doctest-dev libsuitesparse-dev libmuparser-dev libcli11-dev libopenblas-dev voro++-dev
  for package in "$apt"/cache/archives/*.deb; do dpkg -x "$package" "$sysroot"; done
  # What would name files of this machine becomes those of the sysroot; the choice of a BLAS, which installing makes.
  find "$sysroot" -type l -lname '/*' -printf '%p %l\n' | while read -r link target; do ln -sfr "$sysroot$target" "$link"; done
  sed -i "/_realOrig\|_IMPORT_PREFIX/!s|\([\";]\)/usr/|\1$sysroot/usr/|g" "$sysroot"/usr/lib/aarch64-linux-gnu/cmake/sundials/*.cmake
  ln -sfr "$sysroot"/usr/lib/aarch64-linux-gnu/openblas-pthread/lib*.so* "$sysroot/usr/lib/aarch64-linux-gnu"
  rm -r "$apt"
  touch "$sysroot/complete"
fi

# shellcheck disable=SC2086
cmake -S . -B "$tree" -G Ninja --toolchain framework/cmake/aarch64.cmake -DCMAKE_SYSROOT="$sysroot" -DCMAKE_BUILD_TYPE=Release ${CMAKE_ARGUMENTS:-}
cmake --build "$tree" --target perikit-program parts perikit_unit perikit_contract
export OMP_WAIT_POLICY=passive
# Not those of speed, nor `plot`: a program that cannot be started is not noticed under qemu, whose vfork is a fork.
ctest --test-dir "$tree" -j "$(nproc)" -R "$tests" -E '^unit\.(machine_limits|plot|point_file)$' --output-on-failure --no-tests=error --timeout 7200
