#!/usr/bin/env bash
# The boundary tension test while bonds fail, at once and gradually, under every kinematics and kernel: 100 x 40 x 4 points until 80 us,
# damage.consistent = true, second_law = false. A Markdown table is printed: that of framework/docs/fracture.md, "Every kinematics and kernel".
#   fracture_table.sh PERIKIT OUT
# With --second-law as third argument that of "Bonds that stay": the kinematics whose updates of bonds would create energy, with and without the
# second law, on 100 x 40 points in plane strain. Minutes.
# Runs that are done are kept, and the cheap ones come first: a stopped command prints what is there and goes on where it was.
# A run that stops early is a result too, and is kept.
set -euo pipefail
perikit=$(realpath "$1")
out=$(realpath -m "$2")
compare=${3:-}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export OMP_WAIT_POLICY=passive LC_ALL=C
mkdir -p "$out"

end=80e-6
kernels=(constant cubic_spline gaussian)
stabilized() { printf '{type="conventional",stabilization={type="%s"%s}}' "$1" "${2:-}"; }
selective() { printf '{type="selective",base="%s"}' "$1"; }
# Folder, name in the table, setting; by cost.
all=(
  bond_based '`bond_based`' '{type="bond_based",surface_correction="none"}'
  ordinary '`ordinary`' '{type="ordinary",surface_correction="none"}'
  conventional '`conventional`' conventional
  silling '`conventional` with `silling`, 1' "$(stabilized silling ,coefficient=1.0)"
  wan '`conventional` with `wan`' "$(stabilized wan)"
  baqp '`baqp`' baqp
  projection '`projection`' projection
  bond_augmented '`bond_augmented`' bond_augmented
  selective_baqp '`selective` over `baqp`' "$(selective baqp)"
  selective_projection '`selective` over `projection`' "$(selective projection)"
  sub_horizon '`sub_horizon`' sub_horizon
  bond_associated '`bond_associated`' bond_associated
  non_spherical '`non_spherical`' non_spherical
  selective_non_spherical '`selective` over `non_spherical`' "$(selective non_spherical)"
)

# By default bonds of these stay where their failure would raise the energy.
lawful=(conventional bond_augmented sub_horizon selective_non_spherical)
seconds() { sed -n 's/^time .* \([0-9.]*\) s steps.*/\1/p' "$out/$1/run.log"; }
done_with() { grep -qsE '^(speed  |failed: )' "$out/$1/run.log" && ! grep -q '^stopped by a signal' "$out/$1/run.log"; }

# run NAME KINEMATICS KERNEL GRADUAL
run() {
  done_with "$1" && return
  rm -rf "${out:?}/$1"
  local status=0
  "$perikit" run configs/partmann/boundary_tension.toml -o "$out/$1" --threads 1 --quiet \
    --set kinematics="$2" --set family.influence="$3" --set damage.gradual="$4" --set damage.consistent=true \
    --set body.lattice.spacing=1e-3 --set constants.dx=1e-3 --set integrator.end_time=$end --set output.frames=1 --set damage.second_law=false || status=$?
  [ "$status" -le 1 ] || exit "$status"   # refused: no result
}
# run_plane NAME KINEMATICS KERNEL SECOND_LAW
run_plane() {
  done_with "$1" && return
  rm -rf "${out:?}/$1"
  local status=0
  "$perikit" run configs/fracture/branching.toml -o "$out/$1" --threads 1 --quiet --set body.plane=strain \
    --set damage="{type=\"critical_stretch\",energy_release_rate=0.75,consistent=true,no_fail=[\"top\",\"bottom\"],second_law=$4}" \
    --set kinematics="$2" --set family.influence="$3" --set constants.sigma=1e6 --set integrator.end_time=$end --set output.frames=1 || status=$?
  [ "$status" -le 1 ] || exit "$status"
}

# Five cells of one run, from what it reports at its end and from its history: failed bonds, dissipated, raised by updates, share of what the
# others took, balance off (as fracture.md measures it).
cells() {
  if ! done_with "$1"; then
    printf ' not run | | | | |'
    return
  fi
  awk -F, -v end=$end '
    function number(key,   at) {
      at = index($0, key)
      if (!at || substr($0, at + length(key)) !~ /^ *-?[0-9]/) {
        print FILENAME ": no number after \"" key "\": " $0 > "/dev/stderr"
        exit 1
      }
      return substr($0, at + length(key)) + 0
    }
    function grouped(n,   text) {
      for (text = ""; n >= 1000; n = int(n / 1000)) text = sprintf(" %03d", n % 1000) text
      return n text
    }
    function percent(share) { return share > 0 && share < 1e-4 ? "< 0.01 %" : sprintf("%.2g %%", 100 * share) }
    FILENAME ~ /run\.log$/ {
      if (/^failed bonds /) failed = number("failed bonds")
      if (/raised the strain energy/) { raised = number("energy, by"); took = number("the others took") }
      if (/^failed: /) {
        stopped = $0
        sub(/^failed: /, "", stopped)
        sub(/^step [0-9]+, time [^ ]+ s: /, "", stopped)
        sub(/( at |[,;]).*/, "", stopped)
      }
      next
    }
    FNR == 1 { for (k = 1; k <= NF; ++k) column[$k] = k; next }
    {
      time = $column["time"]; work = $column["external_work"]; dissipated = $column["dissipated_energy"]
      held = $column["strain_energy"] + $column["kinetic_energy"]
      if (FNR == 2) start = held
      if (work > most) most = work
      missing = work - (held - start) - dissipated
      if (missing < 0) missing = -missing
      if (time > end / 8 && most > 0 && missing / most > off) off = missing / most
    }
    END {
      if (stopped != "") printf " stopped at %.3g us: %s | %.2g J | | |", 1e6 * time, stopped, dissipated
      else {
        printf " %s | %.2g J |", grouped(failed), dissipated
        if (raised > 0) printf " %.1e J | %s |", raised, (took > 0 ? percent(raised / took) : "all")
        else printf " 0 | 0 |"
      }
      printf " %s |", percent(off)
    }' "$out/$1/run.log" "$out/$1/history.csv"
}

table() {
  local what='failed bonds | dissipated | raised by updates | share of what the others took | balance off |'
  printf '| kinematics | kernel | %s gradual: %s\n|---|---|---|---|---|---|---|---|---|---|---|---|\n' "$what" "$what"
  local k kernel name
  for ((k = 0; k < ${#all[@]}; k += 3)); do
    for kernel in "${kernels[@]}"; do
      name=${all[k]}_$kernel
      done_with "$name" || done_with "${name}_gradual" || continue
      printf '| %s | `%s` |' "${all[k + 1]}" "$kernel"
      cells "$name"
      cells "${name}_gradual"
      printf '\n'
    done
  done
}

comparison() {
  local what='failed bonds | dissipated | raised by updates | share of what the others took | balance off |'
  printf '| kinematics | kernel | %s with the second law: %s bonds that stayed | time, times as long |\n' "$what" "$what"
  printf '|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n'
  local name kernel k
  for name in "${lawful[@]}"; do
    for kernel in "${kernels[@]}"; do
      done_with "${name}_${kernel}_lawful" || continue
      for ((k = 0; k < ${#all[@]}; k += 3)); do
        if [ "${all[k]}" = "$name" ]; then printf '| %s | `%s` |' "${all[k + 1]}" "$kernel"; fi
      done
      cells "${name}_${kernel}_lawless"
      cells "${name}_${kernel}_lawful"
      printf ' %s | %.2g |\n' "$(awk '/^bonds held/ { print $3 }' "$out/${name}_${kernel}_lawful/run.log")" \
        "$(awk -v a="$(seconds "${name}_${kernel}_lawful")" -v b="$(seconds "${name}_${kernel}_lawless")" 'BEGIN { print a/b }')"
    done
  done
}

if [ "$compare" = --second-law ]; then trap comparison EXIT; else trap table EXIT; fi
trap 'exit 130' INT
trap 'exit 143' TERM
for ((k = 0; k < ${#all[@]}; k += 3)); do
  for kernel in "${kernels[@]}"; do
    if [ "$compare" = --second-law ]; then
      [[ " ${lawful[*]} " != *" ${all[k]} "* ]] || for law in false true; do
        run_plane "${all[k]}_${kernel}_law$([ $law = true ] && echo ful || echo less)" "${all[k + 2]}" "$kernel" $law
      done
      continue
    fi
    run "${all[k]}_$kernel" "${all[k + 2]}" "$kernel" false
    run "${all[k]}_${kernel}_gradual" "${all[k + 2]}" "$kernel" true
  done
done
