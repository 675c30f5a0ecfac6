# For the scripts of this folder: SCRIPT UNFLEX DATA. Each goes a user's way in an empty folder.
set -euo pipefail

UNFLEX=$1
DATA=$2
FOLDER=$(mktemp -d)
trap 'rm -rf "$FOLDER"' EXIT
cd "$FOLDER"

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

# has FILE TEXT: the file holds the text.
has() {
  grep --quiet --fixed-strings -- "$2" "$1" || fail "'$2' is not in $1: $(head -c 2000 "$1")"
}

# refused STATUS WORD...: the command ends with this status, and its words are in err.txt.
refused() {
  local wanted=$1 status=0
  shift
  "$@" >out.txt 2>err.txt || status=$?
  [[ $status -eq $wanted ]] || fail "$* ended with $status, not $wanted: $(cat err.txt)"
}
