#!/usr/bin/env bash
# same_bytes.sh OTHER [WORD]
#
# Whether this tree does what another version does: what is written, said and returned must be the
# same, byte for byte, for all prints of tests/data, three firmwares, all ways to compensate and all
# commands (same_bytes.py). OTHER is a revision, which is built first, or a program. WORD: only cases
# whose names contain it, as wallring, exact or tune. What the other version did is kept in
# build/same_bytes and not computed again.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
other=$1
shift

if [[ ! -x $other || -d $other ]]; then
  commit=$(git -C "$root" rev-parse --verify --end-of-options "$other^{commit}")
  folder=$root/build/same_bytes/$commit
  other=$folder/build/unflex
  if [[ ! -x $other ]]; then
    mkdir --parents "$folder"
    git -C "$root" archive "$commit" | tar --extract --directory "$folder"
    # With the folders and options of tests/run.sh ccache has most objects.
    cmake -G Ninja -S "$folder" -B "$folder/build" -DCMAKE_BUILD_TYPE=Release -DUNFLEX_WERROR=ON >/dev/null
    cmake --build "$folder/build" --target unflex
  fi
fi

if [[ ! -e $root/build/CMakeCache.txt ]]; then
  cmake -G Ninja -S "$root" -B "$root/build" -DCMAKE_BUILD_TYPE=Release
fi
cmake --build "$root/build" --target unflex
exec python3 -B "$root/tests/same_bytes.py" --keep "$root/build/same_bytes" "$other" "$root/build/unflex" "$@"
