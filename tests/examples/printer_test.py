"""The example of a printer file: printer_test.py UNFLEX EXAMPLES DOCS

UNFLEX is the program, EXAMPLES the folder with the file, DOCS the one whose page has a table of all
keys.
"""

import json
import math
import os
import re
import subprocess
import sys
import tempfile
import unittest

UNFLEX, EXAMPLES, DOCS = (os.path.abspath(path) for path in sys.argv[1:4])

PRINT = "G28\nG90\nM83\nG1 X20 Y20 F6000\nG1 X40 Y20 E0.8 F3000\n"
KEY = r"(# )?(\w+) = "
MASS = re.compile(r"(# )?(mass_g|stiffness_n_mm|damping_n_s_mm) = ")
SEVERAL = re.compile(r"# (mode|plant) = ")
# Unset, these limit nothing, so their comments show an example.
NO_DEFAULT = re.compile(r"# (written|max_flow_mm3_s|max_speed_mm_s|outer_wall_tolerance_um|gain_c|advance_s|time_constant_s|"
                        r"dead_time_s|heater_w) = ")
# For other machines than the example's.
OTHERS = re.compile(r"# (joint_[abc]|map|offset_mm|home_mm|range_[abc]_mm|bars_mm|rail_[yz]_mm|tool_joint_[abc]_mm|"
                    r"elbow_deg|tool_mass_g) = ")
# The sections of drives, which stand in for the axes'.
DRIVES = re.compile(r"# \[dynamics\.[abc]\]")
TOOL = re.compile(r"# (\[tool\.\d+\]|dynamics\.\S+ = |offset_mm = \[17)")
MODAL = re.compile(r"(# )?(freq_hz|damping_ratio) = ")


def text_of(folder, name):
    with open(os.path.join(folder, name), encoding="utf-8") as file:
        return file.read()


def uncommented(lines):
    """The lines with each key and section that is a comment put in force, but for drives."""
    result = []
    of_drive = False
    for line in lines:
        if re.match(r"(# )?\[|$", line):
            of_drive = DRIVES.match(line) is not None
        kept = of_drive or OTHERS.match(line)
        result.append(line if kept else re.sub(r"^# (?=\[[a-z.]+\]|\w+ = )", "", line))
    return result


class PrinterFile(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.lines = text_of(EXAMPLES, "printer.toml").splitlines()

    def settings(self, lines):
        """The value of each key that the program takes from the lines."""
        with tempfile.TemporaryDirectory() as folder:
            for name, text in (("in.gcode", PRINT), ("printer.toml", "\n".join(lines))):
                with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
                    file.write(text)
            done = subprocess.run(
                [UNFLEX, "inspect", "in.gcode", "--printer", "printer.toml", "--report", "-"],
                cwd=folder, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return {key: row["value"] for key, row in json.loads(done.stdout)["printer"].items()}

    def test_what_is_a_comment_is_the_default(self):
        given = self.settings(self.lines)
        shown = self.settings(uncommented([line for line in self.lines
                                           if not MASS.match(line) and not SEVERAL.match(line)
                                           and not NO_DEFAULT.match(line)]))
        self.assertEqual(given.keys(), shown.keys())
        for key, value in given.items():
            if isinstance(value, float):
                # Some are rounded.
                self.assertTrue(math.isclose(value, shown[key], rel_tol=0.01), (key, value))
            else:
                self.assertEqual(shown[key], value, key)

    def test_the_mass_may_stand_for_the_frequency(self):
        shown = self.settings(uncommented([line for line in self.lines
                                           if not MODAL.match(line) and not SEVERAL.match(line)]))
        for axis in "xy":
            self.assertAlmostEqual(shown[f"dynamics.{axis}.freq_hz"], 45, places=1)
            self.assertAlmostEqual(shown[f"dynamics.{axis}.damping_ratio"], 0.06, places=3)

    def test_several_modes_may_stand_for_the_frequency(self):
        shown = self.settings(uncommented([line for line in self.lines
                                           if not MODAL.match(line) and not MASS.match(line)
                                           # What suits 45 Hz is too long for 110 Hz.
                                           and "period_ms" not in line]))
        for axis in "xy":
            self.assertIn("110", str(shown[f"dynamics.{axis}.mode"]))
            self.assertEqual(shown[f"dynamics.{axis}.freq_hz"], 45)

    def test_tools_may_have_their_own(self):
        first = next(number for number, line in enumerate(self.lines) if line == "# [tool.0]")
        tools = [re.sub(r"^# ", "", line) if TOOL.match(line) else line
                 for line in self.lines[first:]]
        shown = self.settings(self.lines[:first] + tools)
        own = {key: value for key, value in shown.items() if key.startswith("tool.")}
        self.assertEqual(own, {"tool.1.dynamics.x.freq_hz": 36,
                               "tool.1.dynamics.x.damping_ratio": 0.08,
                               "tool.1.dynamics.y.freq_hz": 34,
                               "tool.1.dynamics.y.damping_ratio": 0.08,
                               "tool.1.offset_mm": [17.5, -2]})
        page = text_of(DOCS, "configuration.md")
        for key in own:
            self.assertIn("`" + key.removeprefix("tool.1.") + "`", page)

    def test_every_key_that_klipper_needs_is_there(self):
        there = set()
        section = ""
        for line in self.lines:
            if found := re.match(r"(?:# )?\[([a-z0-9.]+)\]", line):
                section = found.group(1)
            elif section.startswith("tool."):
                continue  # the page has a list of these
            elif found := re.match(KEY, line):
                there.add(f"{section}.{found.group(2)}")
        rows = re.findall(r"^\| `([\w.]+)` \|.*\| (.*) \|$", text_of(DOCS, "configuration.md"),
                          re.MULTILINE)
        needed = {key for key, meaning in rows
                  if "Klipper" in meaning or not re.search(r"\b(Marlin|RRF)\b", meaning)}
        self.assertGreater(len(needed), 40)
        self.assertEqual(needed - there, set())
        self.assertEqual(there - {key for key, _ in rows}, {".schema_version"})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
