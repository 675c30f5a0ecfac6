#!/usr/bin/env bash
# make_page.sh PROGRAM.wasm UNPACK.wasm COPYRIGHT VERSION OUT.html
#
# Makes the page of one file: markup, style, scripts, the program and the terms of its parts.
set -euo pipefail

program=$1
unpack=$2
copyright=$3
version=$4
out=$5
web=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
page=$web/page

work=$(mktemp --directory)
trap 'rm --recursive --force "$work"' EXIT
# How many bytes there are, then four bytes as five letters, none of which ends a script.
as_text() {
  python3 -c 'import base64, sys
data = open(sys.argv[1], "rb").read()
print(len(data), base64.b85encode(data, pad=True).decode().replace("<", ","), end="")' "$1"
}
# As unpack.cpp takes it. xz leaves the length in the head open, so it is put there.
packed() {
  local length byte
  length=$(stat --format=%s "$1")
  xz --format=lzma --lzma1=preset=9e,lc=4,lp=0,pb=0,nice=273 --stdout "$1" >"$work/packed"
  for ((byte = 0; byte < 8; ++byte)); do
    printf '%b' "\\x$(printf '%02x' $((length >> (8 * byte) & 255)))"
  done | dd of="$work/packed" bs=1 seek=5 conv=notrunc status=none
  as_text "$work/packed"
}
packed "$program" >"$work/@PROGRAM@"
packed "$copyright" >"$work/@COPYRIGHT@"
as_text "$unpack" >"$work/@UNPACK@"
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
    while (match(rest, /@(PROGRAM|UNPACK|COPYRIGHT|WORKER|SCRIPT|VERSION|style\.css)@/)) {
      printf "%s", substr(rest, 1, RSTART - 1)
      put(substr(rest, RSTART, RLENGTH))
      rest = substr(rest, RSTART + RLENGTH)
    }
    print rest
  }' "$page/index.html" >"$out.new"
mv "$out.new" "$out"
