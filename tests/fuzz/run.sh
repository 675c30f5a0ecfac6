#!/usr/bin/env bash
# run.sh [SECONDS [TARGET]...]
#
# Builds the fuzzing programs into build-fuzz/ with clang, and has each of them, or those named, look
# for what breaks for so many seconds (12) on all cores, beginning with the stored corpus. What it
# finds is left in build-fuzz/finds/, what reached new code in build-fuzz/corpus/.
set -euo pipefail

here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
root=$(cd -- "$here/../.." && pwd)
build=$root/build-fuzz
seconds=${1:-12}
targets=("${@:2}")
if ((${#targets[@]} == 0)); then
  targets=(gcode settings records container compensate)
fi

"$root/cmake/install_packages.sh" --fuzz

if [[ ! -e $build/CMakeCache.txt ]]; then
  cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DUNFLEX_FUZZ=ON \
    -DCMAKE_CXX_COMPILER=clang++-16 \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -gline-tables-only -DNDEBUG"
fi
cmake --build "$build" --parallel "$(nproc)" --target fuzz

for target in "${targets[@]}"; do
  echo "Fuzzing $target for $seconds s"
  mkdir -p "$build/corpus/$target" "$build/finds/$target"
  # Prints are made of the same words as lines.
  dictionary=$here/${target/compensate/gcode}.dict
  # Half a second and half a gigabyte are more than any such small input may take; with sanitizers
  # and its branches counted, sixty times (the fit of a record: 0.09 s and 4.5 s) and twice as much.
  # What is freed stays in quarantine: at the default of 256 MB a few hundred records, one after
  # another, come to 1.3 GB, with this to 0.6 GB, whichever they are.
  ASAN_OPTIONS=quarantine_size_mb=64 "$build/tests/fuzz/fuzz_$target" -fork="$(nproc)" \
    -max_total_time="$seconds" -timeout=30 -rss_limit_mb=1024 -max_len=4096 -dict="$dictionary" \
    -artifact_prefix="$build/finds/$target/" "$build/corpus/$target" "$here/corpus/$target"
done
