#!/usr/bin/env bash
# An Ender-3 on Marlin, sliced by Cura, without an accelerometer. tests/cura has Cura's own script,
# on Windows too.
source "$(dirname -- "${BASH_SOURCE[0]}")/common.sh"

cp "$DATA/pipeline_textplate.gcode" plate.gcode
cat >m503.txt <<'END'
Recv: FIRMWARE_NAME:Marlin 2.1.2 (Jan  1 2024) MACHINE_TYPE:Ender-3
Recv: echo:  M92 X80.00 Y80.00 Z400.00 E93.00
Recv: echo:  M203 X500.00 Y500.00 Z5.00 E25.00
Recv: echo:  M201 X500.00 Y500.00 Z100.00 E5000.00
Recv: echo:  M204 P500.00 R1000.00 T500.00
Recv: echo:  M205 B20000.00 S0.00 T0.00 J0.08
Recv: ok
END

# A bare print: neither the printer nor its resonances are known.
refused 1 "$UNFLEX" compensate plate.gcode -o plate.unflex.gcode
has err.txt "--set printer.firmware=marlin"
refused 1 "$UNFLEX" compensate plate.gcode -o plate.unflex.gcode --set printer.firmware=marlin
has err.txt "unflex tune"
refused 1 "$UNFLEX" compensate plate.gcode --ouput plate.unflex.gcode
has err.txt "--output"

# Marlin answered, and a ringing tower was printed and measured with a ruler.
"$UNFLEX" identify --wave-spacing-mm 1.8 --speed-mm-s 80 --decay 1.5 --axis x >tower.txt
has tower.txt "freq_hz = 44.4"
"$UNFLEX" printer init --from m503.txt -o printer.toml --set kinematics.type=cartesian \
  --set dynamics.x.freq_hz=44.4 --set dynamics.y.freq_hz=38 >init.txt 2>init.err

# Its 500 mm/s² are too few to see anything in a tower of unflex' own.
printf '[kinematics]\ntype = "cartesian"\n[printer]\nfirmware = "marlin"\n%s\n' \
  "[limits]
print_accel_mm_s2 = 500
max_x_accel_mm_s2 = 500
max_y_accel_mm_s2 = 500" >stock.toml
refused 1 "$UNFLEX" tune -o tower.gcode --nozzle-temp 210 --printer stock.toml
has err.txt "give --accel 750"

"$UNFLEX" compensate plate.gcode --in-place --printer printer.toml >summary.txt 2>summary.err
has plate.gcode ";unflex run"
has summary.txt "Safe?         Yes, every rule is kept."
# By a slicer's mistake the script runs twice.
refused 2 "$UNFLEX" compensate plate.gcode --in-place --printer printer.toml
has err.txt "already compensated by unflex"
