#!/usr/bin/env bash
# run.sh [CTEST OPTION]...
#
# Installs what is missing on Debian 12, builds unflex and its tests into build/ and runs them all,
# or those that the options choose. Then, unless there are options, fuzzes for a minute.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)

"$root/cmake/install_packages.sh" --tests

generator=()
if [[ ! -e $root/build/CMakeCache.txt ]]; then
  generator=(-G Ninja)
fi
cmake "${generator[@]}" -S "$root" -B "$root/build" -DCMAKE_BUILD_TYPE=Release -DUNFLEX_TESTS=ON
cmake --build "$root/build" --parallel "$(nproc)"

ctest --test-dir "$root/build" --output-on-failure --parallel "$(nproc)" "$@"
if (($# == 0)); then
  "$root/tests/fuzz/run.sh" 12
fi
