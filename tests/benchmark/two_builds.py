#!/usr/bin/env python3
"""Compares two builds of unflex, in turns, so that a noisy machine is noisy for both.

    tests/benchmark/two_builds.py OLD NEW [--runs N] [--jobs N] MODE:PRINT[:LAYERS]...

OLD and NEW are executables, PRINT a file of G-code of which the first LAYERS count, or all. MODE is

    default     Klipper, as sliced          faster      --faster
    exact       with exact frequencies      optimal     --faster --timing optimal
    marlin      Marlin, as sliced           rrf         RepRapFirmware, as sliced
    FILE.cfg+RECORD_X+RECORD_Y              the printer file that each build makes of these

One row of a Markdown table per argument: medians of both builds' wall and processor seconds, how
many times as fast the new one is, its peak memory, and what both leave of the error. Both must
exist and keep all limits, or the row says which does not.
"""

import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

KNOWN = ["dynamics.x.freq_hz=45", "dynamics.y.freq_hz=45", "limits.max_accel_mm_s2=5000"]
MODES = {
    "default": ["printer.firmware=klipper"],
    "exact": ["printer.firmware=klipper", "dynamics.freq_error=0"],
    "faster": ["printer.firmware=klipper"],
    "optimal": ["printer.firmware=klipper"],
    "marlin": ["printer.firmware=marlin", "printer.variant=mainline"],
    "rrf": ["printer.firmware=rrf"],
}
FLAGS = {"faster": ["--faster"], "optimal": ["--faster", "--timing", "optimal"]}


def first_layers(print_file, layers, to):
    """Writes the print's first layers, as its slicer marks them."""
    kept, begun = [], 0
    for line in pathlib.Path(print_file).read_text(errors="replace").splitlines(keepends=True):
        begun += bool(re.match(r";(LAYER_CHANGE|LAYER:)", line))
        if layers and begun > layers:
            break
        kept.append(line)
    to.write_text("".join(kept))


def options_of(build, mode, folder):
    """The options of a mode; of one with records, the printer file that this build makes."""
    if mode in MODES:
        sets = MODES[mode] + KNOWN
        return [word for key in sets for word in ("--set", key)] + FLAGS.get(mode, [])
    config, *records = mode.split("+")
    file = folder / f"{abs(hash((build, mode)))}.toml"
    if not file.exists():
        command = [build, "printer", "init", "--from", config, "-o", str(file)]
        for record in records:
            command += ["--record", record]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return ["--printer", str(file)]


def run(build, print_file, options, jobs, folder):
    """Wall and processor seconds, MB, and the report of one run; None if the run failed."""
    report = folder / "report.json"
    command = [build, "compensate", str(print_file), "-o", str(folder / "out.gcode"), "--quiet",
               "--report", str(report), "-j", str(jobs)] + options
    report.unlink(missing_ok=True)
    begin = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall_s = time.monotonic() - begin
    if status != 0 or not report.exists():
        return None
    told = json.loads(report.read_text())
    return wall_s, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, told


def error_of(told):
    """RMS and largest error, and RMS at corners, µm."""
    error = told["deviation"]["compensated"]["extruding"]
    corner = told["corners"]["compensated"]["rms_mm"]
    return [1000 * error["contour_rms_mm"], 1000 * error["contour_max_mm"], 1000 * (corner or 0)]


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("\n\n")[1].strip())
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("rows", nargs="+", metavar="MODE:PRINT[:LAYERS]")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    print("| | wall, s | × | processor, s | × | peak MB | RMS, largest, corner, µm |")
    print("|---|---|---|---|---|---|---|")
    missed = False
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for row in arguments.rows:
            mode, print_file, *layers = row.split(":")
            cut = folder / "print.gcode"
            first_layers(print_file, int(layers[0]) if layers else 0, cut)
            builds = [arguments.old, arguments.new]
            runs = {build: [] for build in builds}
            for _ in range(arguments.runs):
                for build in builds:
                    runs[build].append(run(build, cut, options_of(build, mode, folder),
                                           arguments.jobs, folder))
            label = f"{pathlib.Path(print_file).stem}, {mode.split('+')[0]}"
            bad = [build for build in builds
                   if None in runs[build] or runs[build][0][3]["violation_count"] > 0]
            if bad:
                missed = True
                print(f"| {label} | {' and '.join(bad)} failed, or broke a limit |||||||")
                continue
            median = [[statistics.median(one[i] for one in runs[build]) for i in range(3)]
                      for build in builds]
            errors = [" / ".join(f"{value:.3g}" for value in error_of(runs[build][0][3]))
                      for build in builds]
            (old_wall, old_cpu, _), (new_wall, new_cpu, memory) = median
            print(f"| {label} | {old_wall:.2f} → {new_wall:.2f} | {old_wall / new_wall:.2f} "
                  f"| {old_cpu:.2f} → {new_cpu:.2f} | {old_cpu / new_cpu:.2f} | {memory:.0f} "
                  f"| {errors[0]} → {errors[1]} |", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
