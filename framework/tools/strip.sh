#!/usr/bin/env bash
# A crack between the gates of configs/fracture/strip.toml: energy per new area over Gc, speed [m/s], largest error of the energy balance
# over the energy dissipated, failed bonds.
#   strip.sh PERIKIT OUT [--set KEY=VALUE]...
set -euo pipefail
perikit=$1 out=$2
shift 2
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
"$perikit" run configs/fracture/strip.toml -o "$out" --threads 1 --quiet "$@"
awk -F, '
  /^#/ { next }
  !head { for (i = 1; i <= NF; ++i) at[$i] = i; head = 1; next }
  {
    t = $at["time"]; e = $at["dissipated_energy"]
    total = $at["strain_energy"] + $at["kinetic_energy"] + e - $at["external_work"]
    if (!started) { first_total = total; started = 1 }
    off = total - first_total; if (off < 0) off = -off
    if (off > most) most = off
    if (!ta && $at["first"] > 0.25) { ta = t; ea = e }
    if (!tb && $at["last"] > 0.25) { tb = t; eb = e }
    end = e
  }
  END {
    if (!tb) { print "the crack did not pass the gates"; exit }
    printf "%.3f %.0f %.2g%%\n", (eb - ea)/(0.06*10), 0.06/(tb - ta), 100*most/end
  }' "$out/history.csv"
