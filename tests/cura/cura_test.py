"""Cura's script with what Cura would give it: cura_test.py UNFLEX SCRIPT

UNFLEX is the program, SCRIPT the file examples/cura/UnflexCompensate.py.
"""

import importlib.util
import json
import os
import stat
import sys
import tempfile
import types
import unittest

UNFLEX, SCRIPT = sys.argv[1:3]
# Cura's prints name Marlin, and no print names resonances.
OPTIONS = ["--engine", "banded", "--set", "printer.firmware=klipper", "--set",
           "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45"]


class Script:
    """What Cura's scripts derive from, as far as this one needs it."""

    def __init__(self):
        settings = json.loads(self.getSettingDataString())["settings"]
        self.values = {key: setting["default_value"] for key, setting in settings.items()}

    def getSettingValueByKey(self, key):
        return self.values[key]


class Message:
    """Cura's boxes on the screen."""

    shown = []

    def __init__(self, text, title, lifetime):
        self.text = text

    def show(self):
        Message.shown.append(self.text)


def load_script():
    """The script, loaded as a submodule as Cura does."""
    for name in ("plugin", "plugin.plugin", "UM"):
        sys.modules[name] = types.ModuleType(name)
        sys.modules[name].__path__ = []
    sys.modules["plugin.Script"] = types.ModuleType("plugin.Script")
    sys.modules["plugin.Script"].Script = Script
    sys.modules["UM.Message"] = types.ModuleType("UM.Message")
    sys.modules["UM.Message"].Message = Message
    spec = importlib.util.spec_from_file_location("plugin.plugin.UnflexCompensate", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def cura_print(layers):
    """Head, start code, layers and end code, each a string."""
    parts = [";FLAVOR:Marlin\n;TIME:36\n;LAYER_COUNT:{}\n".format(layers),
             ";Generated with Cura_SteamEngine 4.13.0\nM140 S60\nM82\nG28\nG92 E0\n"]
    e = 0.0
    for n in range(layers):
        lines = [";LAYER:{}".format(n), "M140 S60", "G0 F6000 X20 Y20 Z{:.1f}".format(0.3 + 0.2 * n),
                 ";TYPE:WALL-OUTER"]
        for x, y in ((40, 20), (40, 40), (20, 40), (20, 20)):
            e += 0.8
            lines.append("G1 F3000 X{} Y{} E{:.5f}".format(x, y, e))
        lines.append(";TIME_ELAPSED:{:.6f}".format(2.0 * (n + 1)))
        parts.append("\n".join(lines) + "\n")
    return parts + ["G1 F1500 E{:.5f}\nM140 S0\nM107\n;End of Gcode\n".format(e - 6.5)]


class UnflexCompensate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.Compensate = load_script().UnflexCompensate
        cls.data = cura_print(5)

    def setUp(self):
        Message.shown.clear()
        self.script = self.Compensate()
        self.script.values.update(program=UNFLEX, options=" ".join(OPTIONS))

    def test_describes_its_settings(self):
        description = json.loads(self.script.getSettingDataString())
        self.assertEqual(description["key"], "UnflexCompensate")
        self.assertEqual(description["version"], 2)
        self.assertEqual(set(description["settings"]), {"program", "printer", "options"})

    def test_keeps_curas_layers(self):
        result = self.script.execute(list(self.data))
        self.assertEqual(len(result), len(self.data))
        for n, layer in enumerate(result[2:-1]):
            self.assertTrue(layer.startswith(";LAYER:{}\nM140 S60\n".format(n)), layer)
            self.assertIn(";unflex run", layer)
            self.assertEqual(layer.count(";TIME_ELAPSED:"), 1)
        self.assertTrue(result[1].startswith(";Generated with"))
        # Its first line is a move, which stays with the last layer.
        self.assertTrue(result[-1].startswith("M140 S0\n"))
        self.assertIn("\n;End of Gcode\n", result[-1])

    def test_gives_what_the_program_gives(self):
        result = "".join(self.script.execute(list(self.data)))
        with tempfile.TemporaryDirectory() as folder:
            sliced = os.path.join(folder, "print.gcode")
            with open(sliced, "w", encoding="utf-8", newline="") as file:
                file.write("".join(self.data))
            out = os.path.join(folder, "out.gcode")
            status = os.spawnv(os.P_WAIT, UNFLEX,
                               [UNFLEX, "compensate", sliced, "-o", out, "-q", *OPTIONS])
            self.assertEqual(status, 0)
            with open(out, encoding="utf-8", newline="") as file:
                self.assertEqual(result, file.read())

    def test_keeps_bytes_that_are_no_text(self):
        odd = ";Müller \udcff\r\n"
        self.data[0] += odd
        try:
            self.assertTrue(self.script.execute(self.data)[0].endswith(odd))
        finally:
            self.data[0] = self.data[0][:-len(odd)]

    def test_of_one_string_makes_one(self):
        result = self.script.execute(["".join(self.data)])
        self.assertEqual(len(result), 1)
        self.assertIn(";unflex run", result[0])

    def test_leaves_strings_without_a_mark_empty(self):
        data = [";head\nG28\nG90\nM83\nG1 X5 Y5 F3000\n", "G1 X25 Y5 E1\n", ";LAYER:1\nG1 X25 Y25 E1\n"]
        result = self.script.execute(data)
        self.assertEqual(result[1], "")
        self.assertTrue(result[2].startswith(";LAYER:1\n"))
        self.assertTrue(result[0].startswith(";head\n"))

    def test_passes_printer_and_options(self):
        with tempfile.TemporaryDirectory() as folder:
            printer = os.path.join(folder, "my printer.toml")
            log = os.path.join(folder, "the log")
            with open(printer, "w", encoding="utf-8") as file:
                file.write("[limits]\nmax_acel_mm_s2 = 1\n")
            self.script.values.update(printer=printer, options="--log '{}'".format(log))
            with self.assertRaisesRegex(RuntimeError, r"my printer\.toml:2: .*max_acel_mm_s2"):
                self.script.execute(list(self.data))
            with open(log, encoding="utf-8") as file:
                self.assertIn("exit code 1", file.read())

    def test_raises_and_shows_what_unflex_says(self):
        once = self.script.execute(list(self.data))
        kept = list(once)
        with self.assertRaisesRegex(RuntimeError, "already compensated by unflex"):
            self.script.execute(once)
        self.assertEqual(once, kept)
        self.assertRegex(Message.shown[0], "^The print is not compensated. .*already compensated")

    def test_says_where_the_program_is_not(self):
        self.script.values["program"] = "/nowhere/unflex"
        with self.assertRaisesRegex(RuntimeError, "cannot run /nowhere/unflex: No such file"):
            self.script.execute(list(self.data))

    def test_says_how_a_silent_program_ended(self):
        with tempfile.TemporaryDirectory() as folder:
            program = os.path.join(folder, "silent")
            with open(program, "w", encoding="utf-8") as file:
                file.write("#!/bin/sh\nexit 4\n")
            os.chmod(program, stat.S_IRWXU)
            self.script.values["program"] = program
            with self.assertRaisesRegex(RuntimeError, "exit code 4"):
                self.script.execute(list(self.data))


class OnWindows(unittest.TestCase):
    def setUp(self):
        self.module = load_script()
        self.module.os = types.SimpleNamespace(name="nt", path=os.path, environ=os.environ)
        self.script = self.module.UnflexCompensate()

    def test_gives_what_the_program_gives_elsewhere(self):
        elsewhere = load_script().UnflexCompensate()
        for script in (self.script, elsewhere):
            script.values.update(program='"{}"'.format(UNFLEX), options=" ".join(OPTIONS))
        data = cura_print(2)
        self.assertEqual(self.script.execute(list(data)), elsewhere.execute(list(data)))

    def test_takes_a_path_in_quotes(self):
        self.script.values.update(printer='"C:\\Users\\Zoë Müller\\it\'s my printer.toml"')
        self.assertEqual(self.script._options(),
                         ["--printer", "C:\\Users\\Zoë Müller\\it's my printer.toml"])

    def test_splits_options_without_touching_backslashes(self):
        words = self.module._words
        self.assertEqual(words(r'--printer "C:\Users\me\my printer.toml" --set  a="x y"z'),
                         ["--printer", r"C:\Users\me\my printer.toml", "--set", "a=x yz"])
        self.assertEqual(words(r'C:\new\O\'Brien.toml "D:\a b\"'.replace("\\'", "'")),
                         [r"C:\new\O'Brien.toml", "D:\\a b\\"])
        self.assertEqual(words("# \\"), ["#", "\\"])
        with self.assertRaisesRegex(RuntimeError, 'cannot read the options --log "x: No closing'):
            words('--log "x')


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
