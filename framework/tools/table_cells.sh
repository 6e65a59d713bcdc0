# Sourced with PERIKIT OUT by scripts whose tables have a run in each cell. Runs that are done are kept.
set -euo pipefail
perikit=$(realpath "$1")
out=$(realpath -m "$2")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
mkdir -p "$out"
silling='{type="conventional",stabilization={type="silling",coefficient=1.0}}'
wan='{type="conventional",stabilization="wan"}'

# What a tool of this folder prints of a run with these settings goes to OUT/FOLDER.txt.   run_cell FOLDER TOOL OPTIONS SETTING...
run_cell() {
  local folder=$out/$1 settings=()
  for setting in "${@:4}"; do settings+=(--set "$setting"); done
  [ -s "$folder.txt" ] && return
  # shellcheck disable=SC2086  # options are words
  "framework/tools/$2" "$perikit" "$folder" $3 "${settings[@]}" > "$folder.part" || echo 'the run ends early' > "$folder.part"
  mv "$folder.part" "$folder.txt"
}
