#!/usr/bin/env bash
# Runs the studies of configs/work_precision and writes framework/docs/work_precision.md with their tables and plots.
#   work_precision.sh PERIKIT OUT            everything
#   work_precision.sh PERIKIT OUT --small    the coarsest bodies only; the page goes to OUT, the documentation stays as it is
# Runs that are done are kept: a stopped command goes on where it was.
set -euo pipefail
perikit=$(realpath "$1")
out=$(realpath -m "$2")
small=${3:-}
resume=--resume
[ -n "$small" ] && resume=
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export OMP_WAIT_POLICY=passive

studies="pulse bar cook cantilever cantilever_faces twist"
docs=framework/docs
[ -n "$small" ] && docs=$out/docs
mkdir -p "$out" "$docs/images"
for study in $studies; do
  file=configs/work_precision/${study}_study.toml
  if [ -n "$small" ]; then
    # The first number of the list, the scene by its whole path.
    sed -E -e 's/^(constants\.[nh] = \[[^],]+),.*/\1]/' -e "s|^scene = \"|scene = \"$PWD/configs/work_precision/|" "$file" > "$out/$study.toml"
    file=$out/$study.toml
  fi
  "$perikit" study "$file" -o "$out/$study" --threads 1 --jobs 2 --keep-going $resume | tee "$out/$study.log" | grep "^run .* of\|runs done"
  done=$(sed -nE 's/^([0-9]+) of ([0-9]+) runs done.*/\1 \2/p' "$out/$study.log")
  [ "${done% *}" = "${done#* }" ] || { echo "work_precision: $study: not every run came to its end"; exit 1; }
  cp "$out/$study/plot.png" "$docs/images/work_precision_$study.png"
done

# The page: each @study@ of the template becomes picture, table of the level, and the whole table folded away.
while IFS= read -r line; do
  study=${line//@/}
  if [[ $line != @*@ ]]; then
    printf '%s\n' "$line"
  else
    printf '![%s](images/work_precision_%s.png)\n\n' "$(sed -n 's/^# //p;q' "$out/$study/table.md")" "$study"
    # The second table of table.md, then the first.
    awk '/^$/ { block++; next } block == 2' "$out/$study/table.md"
    printf '\n<details><summary>All runs (<code>perikit study configs/work_precision/%s_study.toml</code>)</summary>\n\n' "$study"
    awk '/^$/ { block++; next } block == 1' "$out/$study/table.md"
    printf '\n</details>\n'
  fi
done < framework/docs/work_precision.md.in > "$docs/work_precision.md.new"
mv "$docs/work_precision.md.new" "$docs/work_precision.md"
