#!/usr/bin/env bash
# Runs the crack tests of Partmann et al. (sections 5.2 and 5.3) at full size and draws their Figs. 16, 18 and 19 into framework/docs/images;
# the tables of framework/docs/fracture.md are printed. The torn rubber sheet is drawn too.
#   fracture.sh PERIKIT PERIKIT_FRACTURE OUT [--coarse]
# --coarse: with twice the spacing, in a sixteenth of the time; pictures go to OUT instead.
# Runs that are done are kept: a stopped command goes on where it was. A run that stops early is a result too, and is kept.
set -euo pipefail
perikit=$(realpath "$1")
measure=$(realpath "$2")
out=$(realpath -m "$3")
coarse=${4:-}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export OMP_WAIT_POLICY=passive
images=framework/docs/images
fine_I=1e-5 fine_tension=0.5e-3 fine_sheet=0.5e-3
[ -n "$coarse" ] && images=$out fine_I=2e-5 fine_tension=1e-3 fine_sheet=1e-3
mkdir -p "$out" "$images"

# run NAME SCENE SETTING...
run() {
  local name=$1 scene=$2
  shift 2
  grep -qsE '^(speed  |failed: )' "$out/$name/run.log" && ! grep -q '^stopped by a signal' "$out/$name/run.log" && return
  rm -rf "${out:?}/$name"
  local settings=()
  for setting in "$@"; do settings+=(--set "$setting"); done
  "$perikit" run "configs/$scene.toml" -o "$out/$name" --quiet "${settings[@]}" || true
}
wan='kinematics={type="conventional",stabilization={type="wan"}}'
silling() { printf 'kinematics={type="conventional",stabilization={type="silling",coefficient=%s}}' "$1"; }
cubic='kinematics=baqp family.influence=cubic_spline damage.consistent=true'

# Ten times as fast as in the paper: 1 m/s apart instead of 0.1 m/s, still 15 passes of a wave until the crack runs.
mode_I() {
  run "mode_I_$1" partmann/mode_I 'boundary=[{set="top",velocity=["free",0.5,"free"]},{set="bottom",velocity=["free",-0.5,"free"]}]' \
    integrator.end_time=1e-5 output.frames=10 body.lattice.spacing=$fine_I constants.dx=$fine_I "${@:2}"
}
mode_I bond_based 'kinematics={type="bond_based",surface_correction="none"}'
mode_I ordinary 'kinematics={type="ordinary",surface_correction="none"}'
mode_I silling_low "$(silling 0.3)"
mode_I silling_high "$(silling 3.0)"
mode_I wan "$wan"
mode_I baqp $cubic
# Rayleigh waves: 2973 m/s in the steel, 2129 m/s in the glass.
"$measure" "$images/mode_I.png" 3 2973 \
  "$out/mode_I_bond_based" 'bond_based' "$out/mode_I_ordinary" ordinary "$out/mode_I_silling_low" 'conventional, silling 0.3' \
  "$out/mode_I_silling_high" 'conventional, silling 3' "$out/mode_I_wan" 'conventional, wan' "$out/mode_I_baqp" 'baqp, cubic_spline'

tension() { run "tension_$1" partmann/boundary_tension body.lattice.spacing=$fine_tension constants.dx=$fine_tension "${@:2}"; }
tension bond_based 'kinematics={type="bond_based",surface_correction="none"}'
tension ordinary 'kinematics={type="ordinary",surface_correction="none"}'
tension silling "$(silling 1.0)"
tension wan "$wan"
tension baqp kinematics=baqp damage.consistent=true
tension baqp_cubic $cubic
"$measure" "$images/boundary_tension_panels.png" 2 2129 \
  "$out/tension_bond_based" 'bond_based' "$out/tension_silling" 'conventional, silling 1' "$out/tension_wan" 'conventional, wan' \
  "$out/tension_baqp" 'baqp, constant' "$out/tension_baqp_cubic" 'baqp, cubic_spline' "$out/tension_ordinary" ordinary

run sheet fracture/rubber_sheet 'kinematics={type="selective",base="baqp"}' body.lattice.spacing=$fine_sheet
"$perikit" plot "$out/sheet" --field damage --deformed 1 -o "$images/rubber_sheet.png"
grep -E '^(failed bonds|warning |energy)' "$out/sheet/run.log"
