#!/usr/bin/env bash
# sanitizers.sh [address | thread] [--only SUITE] [CTEST OPTION]...
#
# Builds unflex and its tests with sanitizers and runs them: with those for addresses and undefined
# behaviour (clang) in build-fuzz/, and with the one for threads (GCC) in build-thread/, or only
# with the named one. Whole sample prints are left out. With the thread sanitizer the browser tests
# are left out, too, since they have nothing to do with threads. With --only one suite, such as
# core_test, is built and run.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)

source "$root/tests/whole_prints.sh"
kinds=(address thread)
if [[ ${1:-} == address || ${1:-} == thread ]]; then
  kinds=("$1")
  shift
fi

suite=()
if [[ ${1:-} == --only ]]; then
  suite=(--target "$2")
  set -- --tests-regex "^$2\$" "${@:3}"
fi

"$root/cmake/install_packages.sh" --tests

for kind in "${kinds[@]}"; do
  if [[ $kind == address ]]; then
    build=${UNFLEX_BUILDS:-$root}/build-fuzz
    options=(-DUNFLEX_FUZZ=ON -DCMAKE_CXX_COMPILER=clang++-16)
    left_out=$whole_prints
  else
    build=${UNFLEX_BUILDS:-$root}/build-thread
    options=(-DUNFLEX_SANITIZE=thread)
    left_out="$whole_prints|^browser"
  fi
  if [[ ! -e $build/CMakeCache.txt ]]; then
    cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=RelWithDebInfo "${options[@]}"
  fi
  cmake --build "$build" --parallel "$(nproc)" "${suite[@]}"
  # The thread sanitizer has its memory at fixed addresses, so addresses must not be random. Its
  # report of leaked threads is off: an interrupted program ends without waiting for its threads.
  # Any other thread that is never joined ends the program anyway.
  TSAN_OPTIONS=halt_on_error=1:report_thread_leaks=0 setarch --addr-no-randomize \
    ctest --test-dir "$build" --output-on-failure --parallel "$(nproc)" \
    --exclude-regex "$left_out" "$@"
done
