#!/usr/bin/env bash
# compile_times.sh [BUILD [COUNT]]: seconds that the files of a build folder (build/release) took when they were last compiled, their sum
# and the slowest COUNT (25), from ninja's log. A compiler is one process, so these are processor seconds as long as no other program
# wants the cores.
set -euo pipefail
build=${1:-"$(dirname "${BASH_SOURCE[0]}")/../../build/release"}
count=${2:-25}
[[ -r $build/.ninja_log ]] || { echo "$build/.ninja_log: not there, or not readable" >&2; exit 2; }
# Columns: start and end [ms], time stamp, output, hash. A file that was compiled again stands there again.
awk -F '\t' '$4 ~ /\.(o|gch)$/ { seconds[$4] = ($2 - $1) / 1000 }
             END { for (file in seconds) printf "%.1f %s\n", seconds[file], file }' "$build/.ninja_log" | sort -k1,1nr |
  awk -v count="$count" '{ total += $1; if (NR <= count) lines = lines sprintf("%8.1f  %s\n", $1, $2) }
                         END { printf "%8.1f  seconds, %d files\n%s", total, NR, lines }'
