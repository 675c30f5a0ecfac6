#!/usr/bin/env bash
# A Voron on Klipper. Its owner has copied printer.cfg alone, and Klipper's two resonance records.
source "$(dirname -- "${BASH_SOURCE[0]}")/common.sh"

cat >printer.cfg <<'END'
[include mainsail.cfg]
[include K-ShakeTune/*.cfg]

[printer]
kinematics: corexy
max_velocity: 300
max_accel: 7000
square_corner_velocity: 5.0

[stepper_x]
position_max: 350
position_endstop: 350

[stepper_y]
position_max: 350
position_endstop: 350

[extruder]
nozzle_diameter: 0.400
filament_diameter: 1.75

[input_shaper]
shaper_type: mzv
shaper_freq_x: 58.2
shaper_freq_y: 43.0
END
cp "$DATA"/spectra/v24_calibration_data_{x,y}_20220611_200739.csv .
# The first layer's walls.
head --lines=620 "$DATA/pipeline_star.gcode" >star.gcode

# The shaper tells roughly where the resonances are.
"$UNFLEX" inspect star.gcode --printer printer.cfg >inspected.txt 2>inspected.err
has inspected.err "printer.cfg:1: warning: the included file"
has inspected.err "unflex identify finds it exactly"

# The records tell more.
"$UNFLEX" printer init --from printer.cfg --record v24_calibration_data_x_20220611_200739.csv \
  --record v24_calibration_data_y_20220611_200739.csv -o printer.toml >init.txt 2>init.err
has init.err "printer.cfg:1: warning: the included file"
has printer.toml "}]  # v24_calibration_data_x_20220611_200739.csv"

"$UNFLEX" compensate star.gcode -o star.unflex.gcode --printer printer.toml --report star.html \
  >summary.txt 2>summary.err
has summary.txt "under the printer's own input shaper, MZV 58.2/43 Hz"
has summary.txt "Safe?         Yes, every rule is kept."
has summary.txt "times the printer's own limit of 9899 mm/s² (printer.toml:"
has star.unflex.gcode "SET_INPUT_SHAPER SHAPER_FREQ_X=58.2 SHAPER_FREQ_Y=43"
has star.html "Where is it worst?"
"$UNFLEX" verify star.unflex.gcode --against star.gcode --printer printer.toml >verified.txt
