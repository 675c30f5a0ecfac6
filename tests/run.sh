#!/usr/bin/env bash
# run.sh [CTEST OPTION]...
#
# Installs what is missing on Debian 12, builds unflex and its tests into build/, with warnings as
# errors, and runs them all, or those that the options choose. `run.sh -L quick` builds and runs what
# belongs to every change and no more.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)

# ctest takes -Lquick without a word and runs everything.
options=()
for option in "$@"; do
  if [[ $option == -Lquick ]]; then
    options+=(-L quick)
  else
    options+=("$option")
  fi
done

target=all
packages=--tests
if [[ " ${options[*]} " == *" -L quick "* ]]; then
  target=quick_tests
  packages=--quick-tests
fi

"$root/cmake/install_packages.sh" "$packages"

generator=()
if [[ ! -e $root/build/CMakeCache.txt ]]; then
  generator=(-G Ninja)
fi
cmake "${generator[@]}" -S "$root" -B "$root/build" -DCMAKE_BUILD_TYPE=Release -DUNFLEX_TESTS=ON \
  -DUNFLEX_WERROR=ON
cmake --build "$root/build" --parallel "$(nproc)" --target "$target"

ctest --test-dir "$root/build" --output-on-failure --parallel "$(nproc)" "${options[@]}"
