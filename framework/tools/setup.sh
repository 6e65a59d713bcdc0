#!/usr/bin/env bash
# Installs the Debian packages that perikit needs and that are missing. Asks before it uses sudo; not as root, with --yes or in CI.
set -euo pipefail

packages=(cmake g++ ninja-build libeigen3-dev libboost-dev libtomlplusplus-dev libsundials-dev libhdf5-dev libfmt-dev doctest-dev
          libopenmpi-dev openmpi-bin libpetsc-real-dev pkgconf libsuitesparse-dev libmuparser-dev libcli11-dev gnuplot-nox libopenblas-dev hdf5-tools voro++-dev python3 python3-h5py python3-venv python3-wheel dpkg-dev)

ask=true
case "${1:-}" in
  "") ;;
  --yes) ask=false ;;
  *) echo "usage: $(basename "$0") [--yes]" >&2; exit 2 ;;
esac
if [[ -n "${CI:-}" ]]; then ask=false; fi

if ! command -v dpkg-query > /dev/null; then
  echo "This is not a Debian system. Install these (or their like) by hand: ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2> /dev/null || true)
  if [[ "$status" != installed ]]; then missing+=("$package"); fi
done
if [[ ${#missing[@]} -eq 0 ]]; then exit 0; fi

as_root=()
if [[ $EUID -ne 0 ]]; then
  as_root=(sudo)
  if $ask; then
    answer=""
    read -rp "Install with sudo: ${missing[*]}? [y/N] " answer || true
    if [[ "$answer" != [yY]* ]]; then
      echo "Not installed: ${missing[*]}" >&2
      exit 1
    fi
  fi
fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -q
"${as_root[@]}" apt-get install -q -y --no-install-recommends "${missing[@]}"
