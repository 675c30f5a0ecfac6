#!/usr/bin/env bash
# A CoreXY on RepRapFirmware. Its owner has config.g and knows the frequencies.
source "$(dirname -- "${BASH_SOURCE[0]}")/common.sh"

sed -e 's/^M208 X-5 Y0 Z0 S1/M208 X-120 Y-120 Z0 S1/' -e 's/^M208 X230 Y210/M208 X120 Y120/' \
  "$DATA/printer/config.g" >config.g
# Two solid layers and what comes before.
head --lines=330 "$DATA/pipeline_vase.gcode" >vase.gcode

# M593 tells roughly where the resonances are; measured ones come with --set.
"$UNFLEX" printer init --from config.g -o printer.toml --set dynamics.x.freq_hz=42.5 \
  --set dynamics.y.freq_hz=38 >init.txt 2>init.err
"$UNFLEX" inspect vase.gcode --printer printer.toml >inspected.txt 2>inspected.err
has inspected.txt "corexy"
"$UNFLEX" compensate vase.gcode -o vase.unflex.gcode --printer printer.toml --report vase.json \
  >summary.txt 2>summary.err
has summary.txt "under the printer's own input shaper, MZV 42.5 Hz"
has summary.txt "Safe?         Yes, every rule is kept."
has vase.json '"is_safe": true'
has vase.unflex.gcode "M593"
"$UNFLEX" verify vase.unflex.gcode --against vase.gcode --printer printer.toml >verified.txt

# Sliced for another bed it brings one warning of that.
"$UNFLEX" inspect vase.gcode --printer "$DATA/printer/config.g" >inspected.txt 2>inspected.err
[[ $(grep --count "leave the printer's travel" inspected.err) -eq 1 ]] ||
  fail "not one warning of the travel: $(cat inspected.err)"
