#!/usr/bin/env bash
# Times whole runs: each FILE as it is, and the first one also two, four and eight times as long (its
# text repeated, so that time and memory can be compared with the work).
#
#   tests/benchmark/whole_files.sh UNFLEX FILE… [-- OPTION…]
#
# One line per run: file, size, print-seconds per wall-second, wall and processor seconds, peak MB.
set -euo pipefail

unflex=$1
shift
files=()
while [[ $# -gt 0 && $1 != -- ]]; do
  files+=("$1")
  shift
done
[[ $# -gt 0 ]] && shift
options=("$@")

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

value() { grep -o "\"$1\": [0-9.]*" "$work/report.json" | head -1 | grep -o '[0-9.]*$'; }

measure() {
  "$unflex" compensate "$2" -o "$work/out.gcode" --quiet --report "$work/report.json" \
    ${options[@]+"${options[@]}"} 2>"$work/errors" || { cat "$work/errors" >&2; exit 1; }
  printf '%-44s %8.2f MB %8.0f print-s/s %8.2f s wall %8.2f s cpu %6.0f MB peak\n' "$1" \
    "$(wc -c <"$2" | awk '{print $1 / 1e6}')" "$(value print_s_per_wall_s)" "$(value wall_s)" \
    "$(value cpu_s)" "$(value peak_rss_mb)"
}

for file in "${files[@]}"; do
  measure "$(basename "$file")" "$file"
done
for times in 2 4 8; do
  for ((i = 0; i < times; ++i)); do cat "${files[0]}"; done >"$work/longer.gcode"
  measure "$(basename "${files[0]}"), $times times" "$work/longer.gcode"
done
