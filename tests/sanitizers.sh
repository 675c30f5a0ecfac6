#!/usr/bin/env bash
# sanitizers.sh [address | thread] [CTEST OPTION]...
#
# Builds unflex and its tests with sanitizers and runs them: with those for addresses and undefined
# behaviour (clang) in build-fuzz/, with the one for threads (GCC) in build-thread/, or with the
# named alone. Whole sample prints are left out, and with the thread sanitizer the browser, which
# knows nothing of threads.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)

source "$root/tests/whole_prints.sh"
kinds=(address thread)
if [[ ${1:-} == address || ${1:-} == thread ]]; then
  kinds=("$1")
  shift
fi

"$root/cmake/install_packages.sh" --fuzz

for kind in "${kinds[@]}"; do
  if [[ $kind == address ]]; then
    build=$root/build-fuzz
    options=(-DUNFLEX_FUZZ=ON -DCMAKE_CXX_COMPILER=clang++-16)
    left_out=$whole_prints
  else
    build=$root/build-thread
    options=(-DUNFLEX_SANITIZE=thread)
    left_out="$whole_prints|^browser"
  fi
  if [[ ! -e $build/CMakeCache.txt ]]; then
    cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=RelWithDebInfo "${options[@]}"
  fi
  cmake --build "$build" --parallel "$(nproc)"
  # The thread sanitizer has its memory at fixed places, which random ones get in the way of. It calls
  # threads leaked that an interrupted program ends without waiting for; any other that is never
  # joined ends the program by itself.
  TSAN_OPTIONS=halt_on_error=1:report_thread_leaks=0 setarch --addr-no-randomize \
    ctest --test-dir "$build" --output-on-failure --parallel "$(nproc)" \
    --exclude-regex "$left_out" "$@"
done
