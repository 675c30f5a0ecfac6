"""The program of another platform: program_test.py UNFLEX DATA COMMAND...

UNFLEX is the program of this machine, DATA the folder of test data, COMMAND what runs the other
program, such as wine and unflex.exe.
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

UNFLEX, DATA = (os.path.abspath(path) for path in sys.argv[1:3])
COMMAND = sys.argv[3:]
IS_WINDOWS = COMMAND[-1].endswith(".exe")
PRINT = os.path.join(DATA, "pipeline_washer_arcs.gcode")
SETTINGS = ["-q", "--set", "printer.firmware=klipper", "--set", "dynamics.x.freq_hz=45", "--set",
            "dynamics.y.freq_hz=38"]
ENVIRONMENT = dict(os.environ, WINEDEBUG="-all")


def read(path):
    with open(path, "rb") as file:
        return file.read()


class Program(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "out.gcode")
            subprocess.run([UNFLEX, "compensate", PRINT, "-o", out, *SETTINGS], check=True)
            cls.whole = read(out)

    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        self.was = os.getcwd()
        os.chdir(self.folder)
        self.addCleanup(os.chdir, self.was)

    def run_program(self, *words, text=None, stdin=subprocess.DEVNULL):
        given = {"input": text} if text is not None else {"stdin": stdin}
        return subprocess.run([*COMMAND, *words], env=ENVIRONMENT, check=False,
                              capture_output=True, **given)

    def expect(self, done, code, said=b""):
        self.assertEqual((done.returncode, done.stderr), (code, said))

    def test_names_may_have_any_letters(self):
        os.mkdir("prüf ♥ x")
        shutil.copy(PRINT, "prüf ♥ x/wäsche.gcode")
        self.expect(self.run_program("compensate", "prüf ♥ x/wäsche.gcode", "-o", "prüf ♥ x/aus ü.gcode",
                                 *SETTINGS), 0)
        self.assertEqual(read("prüf ♥ x/aus ü.gcode"), self.whole)
        self.assertEqual(sorted(os.listdir("prüf ♥ x")), ["aus ü.gcode", "wäsche.gcode"])

    def test_names_may_be_long(self):
        folder = os.path.join(*["l" * 60] * 6)
        os.makedirs(folder)
        shutil.copy(PRINT, os.path.join(folder, "a.gcode"))
        self.expect(self.run_program("compensate", folder + "/a.gcode", "-o", folder + "/b.gcode",
                                 *SETTINGS), 0)
        self.assertEqual(read(os.path.join(folder, "b.gcode")), self.whole)

    def test_replaces_in_place_once(self):
        shutil.copy(PRINT, "p.gcode")
        words = ("compensate", "--in-place", "p.gcode", "--log", "l.txt", *SETTINGS)
        self.expect(self.run_program(*words), 0)
        self.assertEqual(read("p.gcode"), self.whole)
        self.assertEqual(self.run_program(*words).returncode, 2)
        self.assertEqual(read("p.gcode"), self.whole)
        self.assertEqual(sorted(os.listdir(".")), ["l.txt", "p.gcode"])
        self.assertNotIn(b"\r", read("l.txt"))
        self.assertIn(b"exit code 2", read("l.txt"))

    def test_streams_carry_bytes_as_they_are(self):
        done = self.run_program("compensate", "-", "-o", "-", *SETTINGS, text=read(PRINT))
        self.assertEqual(done.returncode, 0)
        self.assertEqual(done.stdout, self.whole)
        with open(PRINT, "rb") as file:
            done = self.run_program("compensate", "-", "-o", "-", *SETTINGS, stdin=file)
        self.assertEqual(done.stdout, self.whole)

    def test_does_a_folder_once(self):
        os.makedirs("in/sub")
        for number in range(3):
            shutil.copy(PRINT, "in/sub/{}.gcode".format(number))
        words = ("batch", "in", "-o", "out", "-j", "2", *SETTINGS[1:])
        first = self.run_program(*words)
        self.assertEqual(first.returncode, 0)
        self.assertIn(b"3 done, 0 unchanged", first.stdout)
        for number in range(3):
            self.assertEqual(read("out/sub/{}.gcode".format(number)), self.whole)
        self.assertIn(b"0 done, 3 unchanged", self.run_program(*words).stdout)
        self.assertEqual(sorted(os.listdir("out")), [".unflex-batch.json", "sub"])

    def test_tells_what_is_wrong(self):
        shutil.copy(PRINT, "p.gcode")
        os.mkdir("in")
        # Windows takes capitals for small letters.
        other = "./in/../P.GCODE" if IS_WINDOWS else "./in/../p.gcode"
        for words, code, said in (
                (("compensate", "no.gcode", "-o", "x.gcode"), 2,
                 b"no.gcode: cannot read: No such file or directory\n"),
                (("compensate", "p.gcode", "-o", "no/x.gcode"), 1,
                 b"no/x.gcode: the directory no does not exist; create it\n"),
                (("compensate", "in", "-o", "x.gcode"), 2,
                 b"in: is a directory, not a G-code file\n"),
                (("compensate", "p.gcode", "-o", other), 1,
                 other.encode() + b": is the input too; to replace it give --in-place\n"),
                (("compensate", "p.gcode", "--in-place", "--engine", "ipopt"), 1,
                 b"unflex: Ipopt is not built into this unflex; the banded engine solves\n")):
            self.expect(self.run_program(*words, *SETTINGS), code, said)
        self.assertEqual(sorted(os.listdir(".")), ["in", "p.gcode"])

    def test_reads_numbers_of_options(self):
        with open("plain.gcode", "w", encoding="utf-8") as file:
            file.write("G28\nM83\nG1 X50 Y50 Z0.2 F6000\nG1 X80 Y50 E1\nG1 X80 Y80 E1\n")
        for most_mm, code in (("9.5", 0), ("1e-6", 3)):
            done = self.run_program("compensate", "plain.gcode", "-o", "out.gcode", "--max-deviation",
                                    most_mm, *SETTINGS)
            self.assertEqual(done.returncode, code, done.stderr)

    def test_ends_when_it_is_interrupted(self):
        with open("long.gcode", "wb") as file:
            file.write(read(PRINT) * 40)
        program = subprocess.Popen(
            [*COMMAND, "compensate", "long.gcode", "-o", "out.gcode", *SETTINGS], env=ENVIRONMENT,
            stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
        end = time.monotonic() + 30
        while len(os.listdir(".")) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        program.send_signal(signal.SIGINT)
        said = program.communicate(timeout=30)[1]
        self.assertEqual((program.returncode, said),
                         (130, b"unflex: interrupted, no file was written\n"))
        self.assertEqual(os.listdir("."), ["long.gcode"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
