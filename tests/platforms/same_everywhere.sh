#!/usr/bin/env bash
# same_everywhere.sh UNFLEX ROOT [PLATFORM...]
#
# Six small prints through the program UNFLEX of this machine and through those of other platforms,
# built in ROOT/build-PLATFORM. Each must give the same bytes. Without PLATFORM: all that are built and can be run here.
# Exit code 77 if there is none.
set -euo pipefail

unflex=$(realpath "$1")
root=$(realpath "$2")
shift 2
data=$root/tests/data

work=$(mktemp --directory)
trap 'rm --recursive --force "$work"' EXIT
cd "$work"

# --- the prints: three firmwares, timing as sliced and free, a band of frequencies, three modes

axes=(--set dynamics.x.freq_hz=45 --set dynamics.y.freq_hz=38)
cp "$data/modes.toml" .
cp "$data/pipeline_washer_arcs.gcode" arcs.gcode
head --lines=140 "$data/study_fasttower.gcode" >tower.gcode
head --lines=160 "$data/pipeline_bracket.gcode" >bracket.gcode
head --lines=110 "$data/pipeline_wallring.gcode" >ring.gcode
head --lines=130 "$data/pipeline_vase.gcode" >vase.gcode
arguments_of() {
  case $1 in
    band) echo arcs.gcode --set printer.firmware=klipper --set dynamics.freq_error=0.1 "${axes[@]}" ;;
    modes) echo bracket.gcode --printer modes.toml ;;
    free) echo tower.gcode --set printer.firmware=klipper --faster=20 "${axes[@]}" ;;
    optimal) echo ring.gcode --set printer.firmware=klipper --faster=20 --timing optimal "${axes[@]}" ;;
    marlin) echo ring.gcode --set printer.firmware=marlin --set printer.variant=mainline "${axes[@]}" ;;
    rrf) echo vase.gcode --set printer.firmware=rrf "${axes[@]}" ;;
  esac
}
prints=(band modes free optimal marlin rrf)

# --- the platforms: how their program is run

run_native() { "$unflex" "$@"; }
run_old() { GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4 UNFLEX_LANES=2 "$unflex" "$@"; }
run_linux-static() { "$root/build-linux-static/unflex" "$@"; }
run_linux-arm64() { qemu-aarch64 "$root/build-linux-arm64/unflex" "$@"; }
run_linux-armhf() { qemu-arm "$root/build-linux-armhf/unflex" "$@"; }
run_windows() { WINEDEBUG=-all wine "$root/build-windows/unflex.exe" "$@"; }
run_wasm() { node "$root/build-wasm/npm/bin/unflex.js" "$@"; }

can_run() {
  case $1 in
    linux-static) [[ -x $root/build-linux-static/unflex ]] ;;
    linux-arm64) [[ -x $root/build-linux-arm64/unflex ]] && command -v qemu-aarch64 ;;
    linux-armhf) [[ -x $root/build-linux-armhf/unflex ]] && command -v qemu-arm ;;
    windows) [[ -e $root/build-windows/unflex.exe ]] && command -v wine ;;
    wasm) [[ -e $root/build-wasm/npm/unflex.wasm ]] && command -v node ;;
  esac >/dev/null
}

platforms=("$@")
if ((${#platforms[@]} == 0)); then
  for platform in linux-static linux-arm64 linux-armhf windows wasm; do
    if can_run "$platform"; then
      platforms+=("$platform")
    fi
  done
fi
if ((${#platforms[@]} == 0)); then
  echo "skipped: no other platform is built"
  exit 77
fi

failed=0
for print in "${prints[@]}"; do
  read -r -a arguments <<<"$(arguments_of "$print")"
  for platform in native old "${platforms[@]}"; do
    began=$SECONDS
    if "run_$platform" compensate -q -o "$platform.gcode" "${arguments[@]}" 2>said; then
      hash=$(sha256sum <"$platform.gcode" | cut --characters=1-16)
      if cmp --quiet native.gcode "$platform.gcode"; then
        verdict=same
      else
        verdict=DIFFERENT
        failed=1
      fi
    else
      hash=
      verdict="FAILED: $(tail --lines=1 said)"
      failed=1
    fi
    printf '%-8s %-13s %3d s  %s  %s\n' "$print" "$platform" $((SECONDS - began)) "$hash" "$verdict"
  done
  rm --force ./*.unflex ./{native,old,windows,wasm,linux-*}.gcode
done
exit "$failed"
