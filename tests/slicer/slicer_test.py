"""From STL to compensated file with the real PrusaSlicer: slicer_test.py UNFLEX

UNFLEX is the program. Exits with 77, which skips the test, where there is no prusa-slicer.
"""

import os
import re
import shlex
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

UNFLEX = os.path.abspath(sys.argv[1])
SLICER = shutil.which("prusa-slicer")
DYNAMICS = ("--set", "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45")

# A picture in the head as PrusaSlicer writes it. Its command line makes none.
THUMBNAIL = """
;
; thumbnail begin 16x16 72
; iVBORw0KGgoAAAANSUhEUgAAABAAAAAQCAYAAAAf8/9hAAAAGUlEQVR4nGNgGAWjYBSMglEwCkbB
; thumbnail end
;
"""


def box(x, y, z):
    """A box as ASCII STL."""
    corners = [(a, b, c) for a in (0, x) for b in (0, y) for c in (0, z)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    text = "solid box\n"
    for a, b, c, d in faces:
        for triangle in ((a, b, c), (a, c, d)):
            vertices = "".join("vertex {} {} {}\n".format(*corners[i]) for i in triangle)
            text += "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n".format(vertices)
    return text + "endsolid box\n"


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def between(text, begin, end):
    """The lines from one that is `begin` to one that is `end`."""
    lines = text.splitlines()
    first = lines.index(begin)
    return lines[first:lines.index(end, first) + 1]


def seconds(text):
    """Of "; estimated printing time (normal mode) = 1h 2m 3s"."""
    said = re.search(r"^; estimated printing time \(normal mode\) = (.*)$", text, re.M).group(1)
    sizes = {"d": 86400, "h": 3600, "m": 60, "s": 1}
    return sum(int(number) * sizes[unit] for number, unit in re.findall(r"(\d+)([dhms])", said))


class Hook(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        # A path with characters that shells and slicers trip over.
        self.prints = os.path.join(self.folder, "it's \"my\" prints")
        os.mkdir(self.prints)
        self.output = os.path.join(self.prints, "a box.gcode")
        self.log = os.path.join(self.folder, "the log")
        self.sliced = os.path.join(self.folder, "sliced.gcode")
        with open(os.path.join(self.folder, "box.stl"), "w", encoding="utf-8") as file:
            file.write(box(10, 10, 0.8))

    def script(self, text):
        """The path of a shell script that gets the print as $1."""
        path = os.path.join(self.folder, "before unflex.sh")
        with open(path, "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\nset -e\n" + text)
        os.chmod(path, stat.S_IRWXU)
        return shlex.quote(path)

    def copying(self):
        """A script that adds a thumbnail and keeps what unflex is going to see."""
        thumbnail = os.path.join(self.folder, "thumbnail")
        with open(thumbnail, "w", encoding="utf-8") as file:
            file.write(THUMBNAIL)
        return self.script("sed -i '1r {}' \"$1\"\ncp \"$1\" '{}'\n".format(thumbnail, self.sliced))

    def unflex(self, *options):
        return " ".join(shlex.quote(word) for word in
                        (UNFLEX, "compensate", "--in-place", "--engine", "banded",
                         "--log", self.log, *DYNAMICS, *options))

    def slice(self, *scripts):
        environment = {key: value for key, value in os.environ.items()
                       if not key.startswith("SLIC3R_")}
        # The slicer runs scripts by the user's shell, and reads the user's settings.
        environment.update(SHELL="/bin/sh", HOME=self.folder)
        command = [SLICER, "--export-gcode", "--loglevel", "1", "--gcode-flavor", "marlin2",
                   "--remaining-times", "--machine-limits-usage", "emit_to_gcode",
                   "--output", self.output]
        # Scripts are separated by semicolons.
        command += ["--post-process", ";".join(scripts)]
        return subprocess.run(command + [os.path.join(self.folder, "box.stl")], env=environment,
                              cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              check=False, text=True)

    def test_compensates_what_is_sliced(self):
        done = self.slice(self.copying(), self.unflex("--set", "printer.firmware=\"marlin\""))
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertEqual(os.listdir(self.prints), ["a box.gcode"])
        before, after = read(self.sliced), read(self.output)
        self.assertIn(";unflex run", after)
        self.assertNotIn(";unflex run", before)
        for begin, end in (("; prusaslicer_config = begin", "; prusaslicer_config = end"),
                           ("; thumbnail begin 16x16 72", "; thumbnail end")):
            self.assertEqual(between(after, begin, end), between(before, begin, end))
        for kind in (r"^; filament used.*$", r"^; total filament.*$", r"^;TYPE:.*$", r"^;Z:.*$",
                     r"^M73 P\d+", r"^; generated by .*$"):
            found = re.findall(kind, before, re.M)
            self.assertTrue(found, kind)
            self.assertEqual(re.findall(kind, after, re.M), found)
        self.assertLess(abs(seconds(after) - seconds(before)), 0.01 * seconds(before) + 2)
        verified = subprocess.run([UNFLEX, "verify", self.output, "--against", self.sliced, "--set",
                                   "printer.firmware=\"marlin\"", "--max-deviation", "0.1",
                                   *DYNAMICS],
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
                                  text=True)
        self.assertEqual(verified.returncode, 0, verified.stdout)
        # The log writes the path's odd characters in its own way.
        self.assertRegex(read(self.log), r"Z unflex [0-9.]+ " + re.escape(self.output) + "\n")
        self.assertRegex(read(self.log), r"\n  exit code 0\n$")

    def test_takes_limits_from_the_environment_where_the_block_is_gone(self):
        report = os.path.join(self.folder, "report.json")
        bare = self.script("sed -i '/prusaslicer_config = begin/,$d' \"$1\"\n")
        done = self.slice(bare, self.unflex("--set", "printer.firmware=\"marlin\"", "--report",
                                            report))
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("\"origin\": \"SLIC3R_MACHINE_MAX_FEEDRATE_X\"", read(report))

    def test_that_fails_says_why_and_leaves_the_file_as_sliced(self):
        done = self.slice(self.copying(), self.unflex("--printer", "no such printer.toml"))
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("no such printer.toml: ", done.stdout)
        self.assertEqual(read(self.output), read(self.sliced))
        self.assertEqual(os.listdir(self.prints), ["a box.gcode"])
        self.assertRegex(read(self.log), r"\n  exit code 1\n$")

    def test_run_twice_compensates_once(self):
        once = os.path.join(self.folder, "once.gcode")
        keep = self.script("cp \"$1\" '{}'\n".format(once))
        marlin = ("--quiet", "--set", "printer.firmware=\"marlin\"")
        done = self.slice(self.unflex(*marlin), keep, self.unflex(*marlin))
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("this file was already compensated by unflex", done.stdout)
        self.assertIn(";unflex run", read(once))
        self.assertEqual(read(self.output), read(once))


if __name__ == "__main__":
    if SLICER is None:
        print("skipped: there is no prusa-slicer")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
