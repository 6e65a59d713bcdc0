#!/usr/bin/env bash
# The double cantilever beam of configs/fracture/double_cantilever.toml: energy dissipated per new area over Gc, the mean of G over Gc while
# the crack grows (P^2 (a + 0.64 h)^2 12/(E h^3), a from the line of the load), and the length of the crack at the end [mm].
#   double_cantilever.sh PERIKIT OUT [--set KEY=VALUE]...
set -euo pipefail
perikit=$1 out=$2
shift 2
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
"$perikit" run configs/fracture/double_cantilever.toml -o "$out" --threads 1 --quiet "$@"
awk -F, '
  NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; next }
  {
    lost = $at["lost"]; e = $at["dissipated_energy"]; p = $at["pull"]
    if (NR == 2) start = lost
    a = 0.03*lost/start
    if (a > before + 1e-9 && NR > 2 && a > 0.035) { arm = a - 0.0005 + 0.64*0.01; sum += 12*p*p*arm*arm/(3e9*1e-6)/500; ++n }
    if (a > 0.035 && !first) { first = a; first_e = e }
    before = a
  }
  END {
    if (a < 0.04) { printf "the crack has come to %.1f mm only\n", 1000*a; exit }
    printf "%.3f %.3f %.1f\n", (e - first_e)/((a - first)*500), sum/n, 1000*a
  }' "$out/history.csv"
