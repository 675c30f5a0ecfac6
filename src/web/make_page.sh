#!/usr/bin/env bash
# make_page.sh PROGRAM.wasm COPYRIGHT VERSION OUT.html
#
# Makes the page of one file: markup, style, scripts, the program and the terms of its parts.
set -euo pipefail

program=$1
copyright=$2
version=$3
out=$4
web=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
page=$web/page

work=$(mktemp --directory)
trap 'rm --recursive --force "$work"' EXIT
packed() {
  gzip --best --no-name --stdout "$1" | base64 --wrap=0
}
packed "$program" >"$work/@PROGRAM@"
packed "$copyright" >"$work/@COPYRIGHT@"
# One mark of strictness for all of a script, and none of node's.
joined() {
  cat "$@" | sed "/^'use strict';$/d; /^if (typeof module === 'object')/d"
}
{ echo "'use strict';"; joined "$web/wasi.js" "$page/memory_files.js" "$page/worker.js"; } >"$work/@WORKER@"
{
  echo "'use strict';"
  joined "$page"/{engine,printers,prints,measure,corner,main}.js
} >"$work/@SCRIPT@"
cp "$page/style.css" "$work/@style.css@"
printf '%s' "$version" >"$work/@VERSION@"

# Each mark of the markup stands for a file.
awk -v folder="$work" '
  function put(mark,   file, text, line) {
    file = folder "/" mark
    text = ""
    while ((getline line < file) > 0) {
      printf "%s%s", text, line
      text = "\n"
    }
    close(file)
  }
  {
    rest = $0
    while (match(rest, /@(PROGRAM|COPYRIGHT|WORKER|SCRIPT|VERSION|style\.css)@/)) {
      printf "%s", substr(rest, 1, RSTART - 1)
      put(substr(rest, RSTART, RLENGTH))
      rest = substr(rest, RSTART + RLENGTH)
    }
    print rest
  }' "$page/index.html" >"$out.new"
mv "$out.new" "$out"
