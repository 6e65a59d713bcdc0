#!/usr/bin/env bash
# The double cantilever beam of configs/fracture/double_cantilever.toml: energy dissipated per new area over Gc, the mean of G over Gc while
# the crack grows, the length of the crack at the end [mm], and the load meanwhile over that of linear elastic fracture mechanics at the same
# opening: mean, least, largest. a: by what the rows beside the crack have lost, from the line of the load, and 0.64 h for the rotation of
# the clamped end. G = 12 P^2 a^2/(E h^3), with the E at which P = E h^3 w/(4 a^3) holds before the crack grows; without a, G = Gc gives
# P = (Gc E h^3/12)^(3/4) (4/(E h^3 w))^(1/2).
#   double_cantilever.sh [--scene FILE] PERIKIT OUT [--set KEY=VALUE]...
set -euo pipefail
scene=configs/fracture/double_cantilever.toml
if [ "$1" = --scene ]; then
  scene=$(realpath "$2")
  shift 2
fi
perikit=$1 out=$2
shift 2
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
"$perikit" run "$scene" -o "$out" --threads 1 --quiet "$@"
opening=$(awk '$1 == "w" && $2 == "=" { print $3 + 0; exit }' "$out/scene.toml")
awk -F, -v opening="$opening" '
  NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; next }
  {
    lost = $at["lost"]; e = $at["dissipated_energy"]; p = $at["pull"]; h = 0.01
    if (NR == 2) start = lost
    a = 0.03*lost/start
    arm = a - 0.0005 + 0.64*h
    if (NR == 3) E = 4*p*arm^3/(h^3*opening*$at["time"])
    if (a > 0.035) {
      ratio = p/((500*E*h^3/12)^0.75*(4/(E*h^3*opening*$at["time"]))^0.5)
      ratios += ratio; ++rows
      if (!least || ratio < least) least = ratio
      if (ratio > largest) largest = ratio
    }
    if (a > before + 1e-9 && NR > 2 && a > 0.035) { sum += 12*p*p*arm*arm/(E*h^3)/500; ++n }
    if (a > 0.035 && !first) { first = a; first_e = e }
    before = a
  }
  END {
    if (a < 0.04) { printf "the crack has come to %.1f mm only\n", 1000*a; exit }
    printf "%.3f %.3f %.1f %.3f %.3f %.3f\n", (e - first_e)/((a - first)*500), sum/n, 1000*a, ratios/rows, least, largest
  }' "$out/history.csv"
