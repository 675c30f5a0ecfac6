#!/usr/bin/env bash
# motor_limits.sh FIRMWARE [KEY=VALUE …]
#
# Writes a test print that shows what the motors can do, as G-code without start and end: put it
# between those of a sliced print, since the axes must be homed and nozzle and bed hot.
#
# It draws the first halves of two combs. Then it drives the head to and fro, at a larger acceleration
# each time, and after each it draws one more tooth of both combs to its end, slowly. A tooth that
# goes on straight has been met again. At the first one with a jog in it, motors have lost steps. Teeth
# of the comb in front tell of X, those of the one on the left tell of Y.
#
#   FIRMWARE             klipper, marlin or rrf
#   center=110,110       middle of the bed, mm
#   size=60              length of the ways to and fro, mm
#   times=20             how many of each kind
#   speed=250            mm/s
#   accels=5000,10000    mm/s², one for each tooth
#   retract=0.8          filament drawn back before travel, mm
#   z=0.2                height of the lines, mm
set -euo pipefail

fail() {
  echo "motor_limits.sh: $1; the head of the script tells how it is used" >&2
  exit 2
}

firmware=${1:-}
[[ $firmware =~ ^(klipper|marlin|rrf)$ ]] || fail "'$firmware' is not klipper, marlin or rrf"
shift
center=110,110 size=60 times=20 speed=250 retract=0.8 z=0.2
accels=5000,7500,10000,12500,15000,20000,25000,30000,35000,40000
for setting in "$@"; do
  [[ $setting =~ ^(center|size|times|speed|accels|retract|z)=[0-9.,]+$ ]] || fail "cannot use '$setting'"
  declare "$setting"
done

awk -v firmware="$firmware" -v center="$center" -v size="$size" -v times="$times" -v speed="$speed" \
  -v accels="$accels" -v retract="$retract" -v z="$z" '
  function accelerate(a) {
    if (firmware == "klipper") {
      printf "SET_VELOCITY_LIMIT ACCEL=%d VELOCITY=%d\n", a, speed
    } else {
      printf "M201 X%d Y%d\nM204 P%d T%d\n", a, a, a, a
    }
  }
  function go(x, y, mm_s) { printf "G0 X%.2f Y%.2f F%d\n", x, y, 60 * mm_s }
  function line(axis, to) {
    printf "G1 Z%.2f F600\nG1 E%.3f F1800\n", z, retract
    printf "G1 %s%.2f E%.3f F1200\n", axis, to, kHalf * kFilament
    printf "G1 E-%.3f F1800\nG1 Z%.2f F600\n", retract, z + 1
  }
  # The first or the second half of a tooth of both combs.
  function tooth(number, half) {
    aside = kApart * (number - (count + 1) / 2)
    from = -size / 2 - 3 * kHalf + half * kHalf
    go(x + aside, y + from, 100)
    line("Y", y + from + kHalf)
    go(x + from, y + aside, 100)
    line("X", x + from + kHalf)
  }
  BEGIN {
    kHalf = 5; kApart = 4; kFilament = 0.036; kSlow = 1000
    split(center, middle, ","); x = middle[1]; y = middle[2]
    count = split(accels, accel, ",")
    # Along each axis, and along the diagonals, on which one motor of a CoreXY does all of the work.
    ways = split("1,0 0,1 1,1 1,-1", way, " ")
    print "G90\nM83"
    accelerate(kSlow)
    printf "G1 E-%.3f F1800\nG1 Z%.2f F600\n", retract, z + 1
    for (i = 1; i <= count; ++i) tooth(i, 0)
    for (i = 1; i <= count; ++i) {
      printf "; tooth %d: %d mm/s2\n", i, accel[i]
      go(x, y, 100)
      print "M400"
      accelerate(accel[i])
      for (w = 1; w <= ways; ++w) {
        split(way[w], to, ",")
        for (n = 0; n < times; ++n) {
          go(x + size / 2 * to[1], y + size / 2 * to[2], speed)
          go(x - size / 2 * to[1], y - size / 2 * to[2], speed)
        }
      }
      print "M400"
      accelerate(kSlow)
      tooth(i, 1)
    }
    printf "G1 E%.3f F1800\nM400\n", retract
  }'
