#!/usr/bin/env bash
# run.sh [SECONDS [TARGET]...]
#
# Builds the fuzzing programs into build-fuzz/ with clang. Runs each of them, or the named ones, for
# so many seconds (12) on all cores, beginning with the stored corpus. Inputs that break something
# are left in build-fuzz/finds/, inputs that reached new code in build-fuzz/corpus/.
set -euo pipefail

here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
root=$(cd -- "$here/../.." && pwd)
build=$root/build-fuzz
seconds=${1:-12}
targets=("${@:2}")
if ((${#targets[@]} == 0)); then
  targets=(gcode settings records container compensate)
fi

"$root/cmake/install_packages.sh" --tests

if [[ ! -e $build/CMakeCache.txt ]]; then
  cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DUNFLEX_FUZZ=ON \
    -DCMAKE_CXX_COMPILER=clang++-16 \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -gline-tables-only -DNDEBUG"
fi
cmake --build "$build" --parallel "$(nproc)" --target fuzz

for target in "${targets[@]}"; do
  echo "Fuzzing $target for $seconds s"
  mkdir -p "$build/corpus/$target" "$build/finds/$target"
  # Prints consist of the same words as lines.
  dictionary=$here/${target/compensate/gcode}.dict
  # Normally such a small input takes at most half a second and half a gigabyte. Sanitizers and
  # counted branches need sixty times as long (the fit of a record: 4.5 s instead of 0.09 s) and
  # twice the memory. Freed memory stays in quarantine: with the default of 256 MB a few hundred
  # records add up to 1.3 GB, with this value to 0.6 GB, whichever records they are.
  ASAN_OPTIONS=quarantine_size_mb=64 "$build/tests/fuzz/fuzz_$target" -fork="$(nproc)" \
    -max_total_time="$seconds" -timeout=30 -rss_limit_mb=1024 -max_len=4096 -dict="$dictionary" \
    -artifact_prefix="$build/finds/$target/" "$build/corpus/$target" "$here/corpus/$target"
done
