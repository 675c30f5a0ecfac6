"""Cura's script with what Cura would give it: cura_test.py UNFLEX SCRIPT

UNFLEX is the program, SCRIPT the file examples/cura/UnflexCompensate.py.
"""

import contextlib
import importlib.util
import json
import ntpath
import os
import shutil
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


# Stands in for Windows' program of that name: notes what it is asked, and has in FOLDER/mnt/c what
# is in C:. It knows two distributions, of which the first is the default.
WSL = r'''#!{python}
import json, os, subprocess, sys

folder = {folder!r}
with open(os.path.join(folder, "asked"), "a", encoding="utf-8") as file:
    file.write(json.dumps(sys.argv[1:]) + "\n")
arguments = sys.argv[1:]
if os.environ.get("WSL_UTF8") != "1":
    sys.exit("WSL_UTF8 is not set")
if os.path.exists(os.path.join(folder, "no_distribution")):
    sys.stdout.buffer.write("There is no distribution.\r\n".encode("utf-16-le"))
    sys.exit(1)
if arguments[0] == "--distribution":
    if arguments[1] not in ("Ubuntu", "Debian 12"):
        sys.exit("there is no " + arguments[1])
    arguments = arguments[2:]
if arguments[0] != "--exec":
    sys.exit("a shell would read the arguments")
program, arguments = arguments[1], arguments[2:]
if program == "wslpath":
    print({{"C:/": "/mnt/c/", "D:/": "/mnt/d"}}[arguments[1]])
    sys.exit(arguments[0] != "-a")
if program not in ("unflex", "/home/me/bin/unflex"):
    sys.exit("<3>WSL ERROR: CreateProcessCommon:640: execvpe(" + program + ") failed: No such file")
inside = [folder + word if word.startswith(("/mnt/", "/home/")) else
          word.replace("=/mnt/", "=" + folder + "/mnt/") for word in arguments]
sys.exit(subprocess.run([{unflex!r}] + inside).returncode)
'''


class Windows:
    """What a module sees of Windows: os, tempfile and open(), with C: in `folder`/mnt/c."""

    TEMPORARY = r"C:\Users\Zoë Müller\AppData\Local\Temp\unflex-1"

    def __init__(self, folder, module):
        self.folder = folder
        os.makedirs(os.path.join(folder, "bin"))
        wsl = os.path.join(folder, "bin", "wsl.exe")
        with open(wsl, "w", encoding="utf-8") as file:
            file.write(WSL.format(python=sys.executable, folder=folder, unflex=UNFLEX))
        os.chmod(wsl, stat.S_IRWXU)
        module.os = types.SimpleNamespace(name="nt", path=ntpath, environ=dict(
            os.environ, PATH=os.path.join(folder, "bin")))
        module.tempfile = types.SimpleNamespace(TemporaryDirectory=self.temporary_directory)
        module.open = lambda path, *rest, **named: open(self.place(path), *rest, **named)

    def place(self, path):
        """Where C:\\… is on this machine."""
        return os.path.join(self.folder, "mnt", path[0].lower(), *path[3:].split("\\"))

    def write(self, path, text):
        os.makedirs(os.path.dirname(self.place(path)), exist_ok=True)
        with open(self.place(path), "w", encoding="utf-8") as file:
            file.write(text)

    @contextlib.contextmanager
    def temporary_directory(self, prefix):
        os.makedirs(self.place(self.TEMPORARY))
        try:
            yield self.TEMPORARY
        finally:
            shutil.rmtree(self.place(self.TEMPORARY))

    def asked(self):
        with open(os.path.join(self.folder, "asked"), encoding="utf-8") as file:
            return [json.loads(line) for line in file]


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
        self.data = cura_print(2)
        self.module = load_script()
        self.script = self.module.UnflexCompensate()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.windows = Windows(folder.name, self.module)
        self.script.values.update(options=" ".join(OPTIONS))

    def unflex(self):
        """The words behind wsl.exe of the last call."""
        return self.windows.asked()[-1]

    def test_gives_what_the_program_gives_elsewhere(self):
        elsewhere = load_script().UnflexCompensate()
        elsewhere.values.update(program=UNFLEX, options=" ".join(OPTIONS))
        self.assertEqual(self.script.execute(list(self.data)), elsewhere.execute(list(self.data)))
        temporary = "/mnt/c/Users/Zoë Müller/AppData/Local/Temp/unflex-1/"
        self.assertEqual(self.unflex(), ["--exec", "unflex", "compensate", "--quiet", *OPTIONS, "-o",
                                         temporary + "compensated.gcode", temporary + "print.gcode"])
        self.assertFalse(os.path.exists(self.windows.place(Windows.TEMPORARY)))

    def test_passes_paths_with_spaces_and_other_letters(self):
        printer = r"C:\Users\Zoë Müller\it's my printer.toml"
        self.windows.write(printer, "[limits]\nmax_accel_mm_s2 = 1500\n")
        for options, values in (('--printer "{}"', ""), ('--printer="{}"', ""), ("", "{}"),
                                ("", '"{}"')):
            self.script.values.update(
                printer=values.format(printer),
                options=" ".join([options.format(printer), r"--log C:\Users\new.log", *OPTIONS]))
            self.assertIn(";unflex run", "".join(self.script.execute(list(self.data))))
            self.assertIn("/mnt/c/Users/Zoë Müller/it's my printer.toml",
                          " ".join(self.unflex()))
            with open(self.windows.place(r"C:\Users\new.log"), encoding="utf-8") as file:
                self.assertIn("exit code 0", file.read())
            os.remove(self.windows.place(r"C:\Users\new.log"))

    def test_splits_options_without_touching_backslashes(self):
        words = self.module._words
        self.assertEqual(words(r'--printer "C:\Users\me\my printer.toml" --set  a="x y"z'),
                         ["--printer", r"C:\Users\me\my printer.toml", "--set", "a=x yz"])
        self.assertEqual(words(r'C:\new\O\'Brien.toml "D:\a b\"'.replace("\\'", "'")),
                         [r"C:\new\O'Brien.toml", "D:\\a b\\"])
        self.assertEqual(words("# \\"), ["#", "\\"])
        with self.assertRaisesRegex(RuntimeError, 'cannot read the options --log "x: No closing'):
            words('--log "x')

    def test_enters_the_distribution_of_a_path(self):
        os.makedirs(os.path.join(self.windows.folder, "home", "me"))
        with open(os.path.join(self.windows.folder, "home", "me", "a b.toml"), "w") as file:
            file.write("[limits]\nmax_accel_mm_s2 = 1500\n")
        for host in ("wsl$", "wsl.localhost", "WSL.localhost"):
            self.script.values.update(printer="\\\\" + host + r"\Debian 12\home\me\a b.toml",
                                      program="/home/me/bin/unflex")
            self.assertIn(";unflex run", "".join(self.script.execute(list(self.data))))
            self.assertEqual(self.unflex()[:7], ["--distribution", "Debian 12", "--exec",
                                                 "/home/me/bin/unflex", "compensate", "--quiet",
                                                 "--printer"])
            self.assertEqual(self.unflex()[7], "/home/me/a b.toml")
        self.script.values.update(program=r"\\wsl$\Ubuntu\home\me\bin\unflex")
        with self.assertRaisesRegex(RuntimeError, "Ubuntu and Debian 12 are two distributions"):
            self.script.execute(list(self.data))

    def test_leaves_words_that_are_no_paths_of_windows(self):
        wsl = self.module._Wsl()
        for word in ("/home/me/p.cfg", "--set", "dynamics.x.freq_hz=45", "-o", "--report", ".html",
                     "a:b", "printer.cfg", r"a\b", "--printer=/home/me/C:/p.cfg"):
            self.assertEqual(wsl.argument(word), word)
        self.assertEqual(wsl.argument(r"--log=d:\x y\z"), "--log=/mnt/d/x y/z")
        self.assertEqual(wsl.argument("C:/x"), "/mnt/c/x")
        self.assertEqual(len(self.windows.asked()), 2)
        with self.assertRaisesRegex(RuntimeError, r"nas.*is in a network folder"):
            wsl.argument(r"\\nas\prints\p.cfg")

    def test_raises_and_shows_what_is_said(self):
        Message.shown.clear()
        self.script.values.update(printer=r"C:\no\printer.cfg")
        with self.assertRaisesRegex(RuntimeError, "/mnt/c/no/printer.cfg: cannot read"):
            self.script.execute(list(self.data))
        self.assertRegex(Message.shown[0], "^The print is not compensated. .*cannot read")
        self.script.values.update(printer="", program="unfelx")
        with self.assertRaisesRegex(RuntimeError, r"execvpe\(unfelx\) failed: No such file; set where"):
            self.script.execute(list(self.data))
        with open(os.path.join(self.windows.folder, "no_distribution"), "w"):
            pass
        with self.assertRaisesRegex(RuntimeError, r"^There is no distribution\.$"):
            self.script.execute(list(self.data))

    def test_says_that_wsl_is_missing(self):
        os.remove(os.path.join(self.windows.folder, "bin", "wsl.exe"))
        with self.assertRaisesRegex(RuntimeError, "cannot run wsl.exe: No such file.*; install WSL"):
            self.script.execute(list(self.data))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
