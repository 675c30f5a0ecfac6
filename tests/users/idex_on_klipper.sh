#!/usr/bin/env bash
# A Klipper with two carriages on X, each with an input shaper of its own, which macros set. Prints
# by one head are compensated with that head's printer file.
source "$(dirname -- "${BASH_SOURCE[0]}")/common.sh"

cp "$DATA/pipeline_textplate.gcode" plate.gcode
cat >printer.cfg <<'END'
[printer]
kinematics: cartesian
max_velocity: 300
max_accel: 4000
[stepper_x]
position_min: -40
position_max: 300
[stepper_y]
position_max: 300
[dual_carriage]
axis: x
[extruder]
nozzle_diameter: 0.4
filament_diameter: 1.75
[extruder1]
nozzle_diameter: 0.4
filament_diameter: 1.75
[input_shaper]
shaper_type: mzv
shaper_freq_x: 52.4
shaper_freq_y: 38.6
[gcode_macro T1]
gcode:
  SET_DUAL_CARRIAGE CARRIAGE=1
  ACTIVATE_EXTRUDER EXTRUDER=extruder1
  SET_INPUT_SHAPER SHAPER_FREQ_X=47.2
END

"$UNFLEX" printer init --from printer.cfg -o left.toml >init.txt 2>init.err
cat init.txt init.err >told.txt
has told.txt "[dual_carriage]: this printer has more than one head"
has told.txt "[gcode_macro T1] sets an input shaper"

# The right head was measured, and has a printer file of its own.
cp left.toml right.toml
"$UNFLEX" compensate plate.gcode -o right.gcode --printer right.toml \
  --set dynamics.x.freq_hz=46.5 --set dynamics.y.freq_hz=38 >summary.txt 2>summary.err
has summary.txt "Safe?         Yes, every rule is kept."
"$UNFLEX" verify right.gcode --against plate.gcode --printer right.toml \
  --set dynamics.x.freq_hz=46.5 --set dynamics.y.freq_hz=38 >verified.txt 2>verified.err
has verified.txt "Safe?         Yes, every rule is kept."
