#!/usr/bin/env bash
# quickstart.sh
#
# From a fresh Debian 12 to a compensated print: installs the packages that are missing (as root or
# with sudo), builds unflex into build/ and compensates examples/washer.gcode into out/.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)

"$root/cmake/install_packages.sh"

echo "Building unflex"
generator=()
if [[ ! -e $root/build/CMakeCache.txt ]]; then
  generator=(-G Ninja)
  # As tests/run.sh builds, so that it need not build again. Another compiler may warn of more.
  if grep --quiet --fixed-strings 'PRETTY_NAME="Debian GNU/Linux 12' /etc/os-release; then
    generator+=(-DUNFLEX_WERROR=ON)
  fi
fi
cmake "${generator[@]}" -S "$root" -B "$root/build" -DCMAKE_BUILD_TYPE=Release -DUNFLEX_TESTS=OFF \
  -Wno-dev --log-level=WARNING >/dev/null
cmake --build "$root/build" --parallel "$(nproc)" --target unflex

mkdir -p "$root/out"
output=$root/out/washer.unflex.gcode
report=$root/out/washer.report.json

echo
echo "Compensating examples/washer.gcode, eight minutes of printing; this takes about half a minute"
echo
cd -- "$root"
build/unflex compensate examples/washer.gcode -o "$output" --printer examples/printer.toml \
  --report "$report" --check-solver --strict

cat <<END

Above: how far the nozzle strays from the sliced path, before → after.
Written:
  $output    for the printer
  $report    all figures
  $root/build/unflex    the program
END
