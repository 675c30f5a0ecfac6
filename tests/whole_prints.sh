# Sourced: the tests of whole prints, of which cuts run the same code, for builds that are slow.
# shellcheck shell=bash disable=SC2034
whole_prints='TenLayers|OtherFirmware|HowFast'
# Without this variable, whole prints are skipped.
unset UNFLEX_SAMPLES
