"""Whether two builds do the same. tests/same_bytes.sh runs this."""

import argparse
import concurrent.futures
import dataclasses
import gzip
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile

DATA = pathlib.Path(__file__).resolve().parent / "data"
FIRMWARES = {
    "klipper": ["printer.firmware=klipper"],
    "marlin": ["printer.firmware=marlin", "printer.variant=mainline"],
    "rrf": ["printer.firmware=rrf"],
}
ONE_MODE = ["dynamics.x.freq_hz=45", "dynamics.y.freq_hz=38"]
# Modes, plants beside them, and a pressure advance.
PLANTS = (DATA / "modes.toml").read_text() + """
[[dynamics.x.plant]]
share = 0.6
mode = [{ freq_hz = 44, damping_ratio = 0.06, gain = 1.0 }]
[[dynamics.x.plant]]
share = 0.2
mode = [{ freq_hz = 47, damping_ratio = 0.05, gain = 1.0 }]
[extruder]
pressure_advance_s = 0.04
"""


@dataclasses.dataclass
class Case:
    """A command line. {data} is the folder of test data; what is written goes into the working folder."""
    name: str
    words: list


def sets(keys):
    return [word for key in keys for word in ("--set", key)]


def compensations():
    """Every print for every firmware; short ones in all ways as well."""
    modes = {
        "default": (sets(ONE_MODE), []),
        "exact": (sets(ONE_MODE + ["dynamics.freq_error=0"]), []),
        "faster": (sets(ONE_MODE), ["--faster"]),
        "plants": (["--printer", "plants.toml"], []),
    }
    prints = sorted(path for pattern in ("*.gcode", "*.bgcode") for path in DATA.glob(pattern))
    for path in prints:
        is_short = path.name.startswith("pipeline")
        for firmware, keys in FIRMWARES.items():
            for mode, (machine, flags) in modes.items():
                if is_short or mode == "default":
                    yield Case(f"compensate {path.stem} {firmware} {mode}",
                               ["compensate", "{data}/" + path.name, "-o", "out" + path.suffix,
                                "--report", "report.json", "-j", "1", "-q", *machine, *sets(keys),
                                *flags])
            yield Case(f"inspect {path.stem} {firmware}",
                       ["inspect", "{data}/" + path.name, *sets(keys + ONE_MODE)])
    for path in sorted((DATA / "prints").glob("*.gcode.gz")):
        yield Case(f"compensate {path.stem}",
                   ["compensate", path.stem, "-o", "out.gcode", "--report", "report.json", "-j", "1",
                    "-q", *sets(FIRMWARES["klipper"] + ONE_MODE)])


def other_commands():
    wallring = "{data}/pipeline_wallring.gcode"
    klipper = sets(FIRMWARES["klipper"] + ONE_MODE)
    compensate = ["compensate", wallring, "-o", "out.gcode", "--report", "report.json", "-q"]
    yield Case("compensate wallring optimal",
               [*compensate, "--faster=20", "--timing", "optimal", *klipper])
    yield Case("compensate wallring corexy", [*compensate, *klipper, "--set", "kinematics.type=corexy"])
    yield Case("compensate wallring html",
               ["compensate", wallring, "-o", "out.gcode", "--report", "report.html", *klipper])
    yield Case("verify wallring", ["verify", wallring, "--against", wallring, "--report",
                                   "report.json", *klipper])
    yield Case("study corner", ["study", "-q", "--report", "report.json"])
    yield Case("study wallring accelerations",
               ["study", wallring, "--accel", "2000,5000", "--report", "report.json", *klipper])
    for file in sorted(path for path in (DATA / "printer").iterdir() if path.is_file()):
        yield Case(f"printer {file.name}", ["printer", "init", "--from",
                                            "{data}/printer/" + file.name, "-o", "printer.toml"])
    for file in sorted((DATA / "spectra").glob("*.csv")):
        yield Case(f"identify {file.name}",
                   ["identify", "{data}/spectra/" + file.name, "--report", "report.json"])
    yield Case("hotend", ["hotend", "{data}/hotend_heating.csv"])
    for name, asked in (("resonances", []), ("pressure", ["--pressure"])):
        yield Case(f"tune {name}",
                   ["tune", "-q", *asked, "--nozzle-temp", "210", "-o", "tower.gcode",
                    "--report", "tower.html",
                    *sets(["printer.firmware=klipper", "printer.travel_x_mm=[0, 200]",
                           "printer.travel_y_mm=[0, 200]"])])
    yield Case("unknown key", ["inspect", wallring, "--set", "dynamics.x.frequency=40"])
    for name in ("compensate", "verify", "inspect", "study", "tune", "hotend", "identify", "printer"):
        yield Case(f"help of {name}", [name, "--help"])


def said_without_times(text):
    """What a program says, without the lines that tell how long it took."""
    return b"".join(line for line in text.splitlines(keepends=True) if b"s in all" not in line)


def report_without_times(report):
    """The report's JSON without what differs from run to run, as bytes."""
    told = json.loads(report)
    for key in ("performance", "version"):
        told.pop(key, None)
    return json.dumps(told).encode()


def outcome(program, case):
    """SHA-256 of all that the program does: what it returns, says, and writes into files."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "plants.toml").write_text(PLANTS)
        for packed in (DATA / "prints").glob("*.gz"):
            if packed.stem in case.words:
                (folder / packed.stem).write_bytes(gzip.decompress(packed.read_bytes()))
        given = {path.name for path in folder.iterdir()}
        words = [word.replace("{data}", str(DATA)) for word in case.words]
        done = subprocess.run([program, *words], cwd=folder, stdin=subprocess.DEVNULL,
                              capture_output=True, check=False)
        seen = {"exit code": str(done.returncode).encode(), "stdout": said_without_times(done.stdout),
                "stderr": said_without_times(done.stderr)}
        for path in sorted(folder.iterdir()):
            if path.name == "report.json":
                seen[path.name] = report_without_times(path.read_bytes())
            elif path.name not in given:
                seen[path.name] = path.read_bytes()
        return {what: hashlib.sha256(content).hexdigest() for what, content in seen.items()}


def kept_outcome(program, case, folder):
    """outcome(), which a file of `folder` remembers."""
    asked = hashlib.sha256(json.dumps([case.words, PLANTS]).encode()).hexdigest()
    path = folder / f"{asked}.json"
    if path.exists():
        return json.loads(path.read_text())
    seen = outcome(program, case)
    path.write_text(json.dumps(seen))
    return seen


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("old", type=os.path.abspath)
    parser.add_argument("new", type=os.path.abspath)
    parser.add_argument("word", nargs="?", default="")
    parser.add_argument("--keep", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    # Data and program are what an outcome depends on.
    key = hashlib.sha256(pathlib.Path(arguments.old).read_bytes())
    for path in sorted(DATA.rglob("*")):
        if path.is_file():
            key.update(path.read_bytes())
    kept = arguments.keep / key.hexdigest()
    kept.mkdir(parents=True, exist_ok=True)

    wanted = [case for case in (*other_commands(), *compensations()) if arguments.word in case.name]
    differ = 0
    failed = 0

    def compare(case):
        return kept_outcome(arguments.old, case, kept), outcome(arguments.new, case)

    success = hashlib.sha256(b"0").hexdigest()
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for case, (before, after) in zip(wanted, pool.map(compare, wanted)):
            failed += before["exit code"] != success
            different = sorted(what for what in before.keys() | after.keys()
                               if before.get(what) != after.get(what))
            if different:
                differ += 1
                print(f"{case.name}: {', '.join(different)}", flush=True)
    print(f"{len(wanted)} cases, {failed} of which end with an error: {differ} differ")
    return 1 if differ or not wanted else 0


if __name__ == "__main__":
    sys.exit(main())
