#!/bin/sh
# Time per point and step of Debian's LAMMPS with its peridynamic laws: the yardstick of the speed targets. 32^3 points, horizon
# 3.015 spacings, free surfaces, one rank, default skin. Five stretches of 20 steps each: on shared machines they differ by a factor
# of up to 1.7, so the figure that counts is the best; compare it with a best of other codes, measured in turn.
#   LAMMPS lps <ns>      linear peridynamic solid: the unit L
#   LAMMPS pmb <ns>      bond-based
# Arguments go to lmp: lammps.sh -var skin 5e-6 is LAMMPS with a list of bonds only.
set -eu
cd "$(dirname "$0")"
points=32768

if ! command -v lmp > /dev/null; then
  if [ "$(id -u)" != 0 ] || ! apt-get install -y --no-install-recommends lammps > /dev/null; then
    echo "lammps.sh: no program 'lmp'; install the package 'lammps'" >&2
    exit 1
  fi
fi

# Every pair of lattice points within the horizon, both ways: 122 bonds in the interior, fewer at the surfaces.
expected_bonds=$(awk 'BEGIN {
  for (x = -3; x <= 3; ++x) for (y = -3; y <= 3; ++y) for (z = -3; z <= 3; ++z) {
    r2 = x * x + y * y + z * z
    if (r2 > 0 && r2 <= 3.015 * 3.015) {
      ++interior
      bonds += (32 - (x < 0 ? -x : x)) * (32 - (y < 0 ? -y : y)) * (32 - (z < 0 ? -z : z))
    }
  }
  if (interior != 122) exit 1
  print bonds }')

# measure LABEL [lmp options]
measure() {
  label=$1
  shift
  if ! output=$(OMP_NUM_THREADS=1 lmp -in "lammps_$label.in" -log none "$@" 2>&1); then
    echo "$output" >&2
    exit 1
  fi
  bonds=$(echo "$output" | awk '/total # of bonds/ {print $NF; exit}')
  if [ "$bonds" != "$expected_bonds" ]; then
    echo "lammps.sh: $label: ${bonds:-no} bonds, expected $expected_bonds" >&2
    exit 1
  fi
  echo "$output" | awk -v points=$points '/^Loop time of/ { printf "%.0f\n", 1e9 * $4 / ($9 * points) }' | sort -n |
    awk -v label="$label" '{ ns[NR] = $1 }
      END { if (NR == 0) exit 1
            printf "%s %d ns per point and step (median %d, worst %d)\n", label, ns[1], ns[int((NR + 1) / 2)], ns[NR]
            printf "LAMMPS %s %d\n", label, ns[1] }'
}

measure lps "$@"
measure pmb "$@"
