#!/usr/bin/env bash
# coverage.sh [--only SUITE] [CTEST OPTION]...
#
# Builds unflex and its tests into build-coverage/ so that they count which lines run. Runs all
# tests except whole sample prints, since pieces of these run the same code. Lists how much of each
# file of src/ and include/ was reached. Fails if that is less than 90 % of all lines, or if no test
# reaches a place that makes an error. With --only it builds and runs one suite, such as core_test, and
# what the others would reach does not count.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
build=${UNFLEX_BUILDS:-$root}/build-coverage
suite=()
if [[ ${1:-} == --only ]]; then
  suite=(--target "$2")
  set -- --tests-regex "^$2\$" "${@:3}"
fi

source "$root/tests/whole_prints.sh"

"$root/cmake/install_packages.sh" --tests

if [[ ! -e $build/CMakeCache.txt ]]; then
  cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Debug -DUNFLEX_TESTS=ON \
    -DCMAKE_CXX_FLAGS="--coverage -fprofile-update=atomic" -DCMAKE_CXX_FLAGS_DEBUG="-O1"
fi
cmake --build "$build" --parallel "$(nproc)" "${suite[@]}"

find "$build" -name '*.gcda' -delete
# Tests keep some programs from writing, so these cannot write their counts. Their messages about
# that must not get into the output that tests read. The AsNobody tests are left out: the user
# nobody may not write the counts of others.
export GCOV_ERROR_FILE=/dev/null UNFLEX_UNCOUNTED=$build/uncounted
ctest --test-dir "$build" --output-on-failure --parallel "$(nproc)" \
  --exclude-regex "$whole_prints|^AsNobody" "$@"

enough=(--fail-under-line 90)
if ((${#suite[@]} > 0)); then
  enough=()
fi
gcovr --root "$root" --object-directory "$build" --filter "$root/src/" --filter "$root/include/" \
  --exclude-unreachable-branches --sort-uncovered "${enough[@]}" --print-summary \
  --txt - --json "$build/coverage.json"
if ((${#suite[@]} == 0)); then
  "$root/tests/unreached_errors.py" "$root" "$build/coverage.json"
fi
