"""Compares what shells complete with the program's help: completions_test.py UNFLEX COMPLETIONS

Each test is skipped if its shell is missing.
"""

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

import program_help

UNFLEX, COMPLETIONS = sys.argv[1:3]
HERE = os.path.dirname(os.path.abspath(__file__))
FILES = ["print.gcode", "print.bgcode", "print.gcode.gz", "printer.toml", "printer.cfg", "config.g", "m503.txt", "sweep.csv",
         "report.json", "report.html", "picture.png"]
PRINTS = {"print.gcode", "print.bgcode", "print.gcode.gz", "config.g", "prints/"}
PRINTERS = {"printer.toml", "printer.cfg", "config.g", "m503.txt", "prints/"}


def lines_of(command, folder, **environment):
    # The completions ask the program for the keys of --set.
    path = os.path.dirname(os.path.abspath(UNFLEX)) + os.pathsep + os.environ["PATH"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True,
                         timeout=120, env={**os.environ, "PATH": path, **environment})
    assert run.stderr == "", run.stderr
    return run.stdout.splitlines()


def keys():
    """The keys that the program has, with what each may be."""
    text = subprocess.run([UNFLEX, "printer", "keys"], check=True, capture_output=True,
                          text=True).stdout
    return dict((line + "  ").split("  ", 1) for line in text.splitlines() if line[0] != " ")


class Completion:
    """The tests, for every shell."""

    def setUp(self):
        if not shutil.which(self.shell):
            self.skipTest(f"there is no {self.shell}")
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = scratch.name
        for name in FILES:
            with open(os.path.join(self.folder, name), "w", encoding="utf-8"):
                pass
        os.mkdir(os.path.join(self.folder, "prints"))

    def files(self, line):
        """The candidates at the end of the line; folders end in a slash."""
        return {name + "/" if os.path.isdir(os.path.join(self.folder, name)) and name[-1:] != "/"
                else name for name in self.candidates(line)}

    def test_commands_are_those_of_the_help(self):
        commands = program_help.commands(UNFLEX)
        for command in commands:
            children = {other[-1] for other in commands if other and other[:-1] == command}
            if children:
                line = " ".join(["unflex", *command, ""])
                self.assertEqual(set(self.candidates(line)), children, line)

    def test_options_are_those_of_the_help(self):
        for command, options in program_help.commands(UNFLEX).items():
            line = " ".join(["unflex", *command, "-"])
            self.assertEqual(self.options(line), options, line)

    def test_a_beginning_is_completed(self):
        self.assertEqual(self.candidates("unflex comp"), ["compensate"])
        self.assertEqual(self.candidates("unflex compensate --eng"), ["--engine"])
        self.assertEqual(self.candidates("unflex compensate --engine ip"), ["ipopt"])

    def test_values_of_options_are_offered(self):
        self.assertEqual(set(self.candidates("unflex study --engine ")),
                         {"auto", "banded", "ipopt"})
        self.assertEqual(set(self.candidates("unflex identify --axis ")), {"x", "y"})
        self.assertEqual(set(self.candidates("unflex hotend --rule ")),
                         {"simc", "simc-pi", "zn", "zn-pi", "cc", "tl"})
        self.assertIn("5B", self.candidates("unflex study --case "))

    def test_files_are_offered_by_what_is_in_them(self):
        for line in ["unflex compensate ", "unflex compensate --in-place ", "unflex inspect ",
                     "unflex study ", "unflex verify ", "unflex verify out.gcode --against ",
                     "unflex compensate in.gcode -o "]:
            self.assertEqual(self.files(line), PRINTS, line)
        for line in ["unflex compensate --printer ", "unflex printer init --from "]:
            self.assertEqual(self.files(line), PRINTERS, line)
        self.assertEqual(self.files("unflex printer init -o "), {"printer.toml", "prints/"})
        self.assertEqual(self.files("unflex verify --report "),
                         {"report.json", "report.html", "prints/"})
        self.assertEqual(self.files("unflex inspect --report "), {"report.json", "prints/"})
        self.assertEqual(self.files("unflex identify "), {"sweep.csv", "prints/"})
        self.assertEqual(self.files("unflex hotend "), {"sweep.csv", "m503.txt", "prints/"})
        self.assertEqual(self.files("unflex batch "), {"prints/"})
        self.assertEqual(self.files("unflex batch prints -o "), {"prints/"})
        self.assertEqual(self.files("unflex batch prints --summary "), {"report.json", "prints/"})

    def test_files_of_any_name_are_offered_where_no_other_matches(self):
        self.assertEqual(self.candidates("unflex inspect pict"), ["picture.png"])

    def test_keys_are_those_of_the_program(self):
        known = {key + "=" for key in keys()}
        self.assertGreater(len(known), 90)
        for command in ["compensate", "batch", "printer init", "identify"]:
            self.assertEqual(set(self.candidates(f"unflex {command} --set ")), known, command)
        self.assertEqual(set(self.candidates("unflex inspect --set dynamics.x.")),
                         {key for key in known if key.startswith("dynamics.x.")})

    def test_words_of_a_key_are_offered(self):
        for key, words in [("printer.firmware", ["klipper", "marlin", "rrf"]),
                           ("emit.checkpoints", ["true", "false"]),
                           ("limits.max_accel_mm_s2", []), ("printer.version", [])]:
            self.assertEqual(set(self.values(key, "")), set(words), key)
        self.assertEqual(self.values("printer.firmware", "ma"), ["marlin"])
        self.assertNotIn("in", self.values("second.shaper", ""))

    def test_numbers_are_left_to_the_user(self):
        self.assertEqual(self.candidates("unflex compensate --max-deviation "), [])


class Bash(Completion, unittest.TestCase):
    shell = "bash"

    def candidates(self, line):
        words = shlex.split(line) + ([""] if line.endswith(" ") else [])
        return self.complete(words)

    def values(self, key, begun):
        """What is offered behind `--set key=`."""
        return self.complete(["unflex", "compensate", "--set", key, "=", *([begun] if begun else [])])

    def complete(self, words):
        script = ('source "$1/unflex.bash" && shift && COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) &&'
                  " _unflex && ((${#COMPREPLY[@]} == 0)) || printf '%s\\n' \"${COMPREPLY[@]}\"")
        return lines_of(["bash", "--norc", "-c", script, "bash", COMPLETIONS, *words], self.folder)

    def options(self, line):
        return set(self.candidates(line))

    def test_a_value_behind_an_equals_sign_is_completed(self):
        self.assertEqual(self.complete(["unflex", "compensate", "--engine", "=", "ip"]), ["ipopt"])
        self.assertEqual(self.complete(["unflex", "compensate", "--engine", "="]),
                         ["auto", "banded", "ipopt"])

    def test_keys_and_words_behind_an_equals_sign_are_completed(self):
        self.assertEqual(self.complete(["unflex", "inspect", "--set", "=", "printer.firmware_r"]),
                         ["printer.firmware_retraction="])
        self.assertEqual(self.complete(["unflex", "inspect", "--set", "=", "printer.firmware", "=", "r"]),
                         ["rrf"])

    def test_no_space_follows_a_key(self):
        script = ('source "$1/unflex.bash"; compopt() { echo "compopt $*"; };'
                  " COMP_WORDS=(unflex inspect --set emit.peri) COMP_CWORD=3; _unflex")
        self.assertEqual(lines_of(["bash", "--norc", "-c", script, "bash", COMPLETIONS],
                                  self.folder), ["compopt -o nospace"])

    def test_names_with_spaces_stay_whole(self):
        with open(os.path.join(self.folder, "a print.gcode"), "w", encoding="utf-8"):
            pass
        self.assertEqual(self.complete(["unflex", "inspect", "a"]), ["a print.gcode"])


class Zsh(Completion, unittest.TestCase):
    shell = "zsh"

    @classmethod
    def setUpClass(cls):
        cls.dumps = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.dumps.cleanup)

    def candidates(self, line):
        return lines_of(["zsh", "-f", os.path.join(HERE, "zsh_candidates.zsh"), COMPLETIONS,
                         os.path.join(self.dumps.name, "zcompdump"), line], self.folder)

    def options(self, line):
        return set(self.candidates(line))

    def values(self, key, begun):
        """What is offered behind `--set key=`."""
        return self.candidates(f"unflex compensate --set {key}={begun}")

    def test_zsh_reads_the_file_without_complaint(self):
        lines_of(["zsh", "-n", os.path.join(COMPLETIONS, "_unflex")], self.folder)


class Fish(Completion, unittest.TestCase):
    shell = "fish"

    def candidates(self, line):
        script = 'source $argv[1]/unflex.fish; complete -C $argv[2]'
        # fish needs a home of its own, or it would write into the user's.
        found = lines_of(["fish", "--no-config", "-c", script, COMPLETIONS, line], self.folder,
                         HOME=self.folder, XDG_CONFIG_HOME=os.path.join(self.folder, ".config"),
                         XDG_DATA_HOME=os.path.join(self.folder, ".local"))
        return [candidate.split("\t")[0] for candidate in found]

    def values(self, key, begun):
        """What is offered behind `--set key=`."""
        found = self.candidates(f"unflex compensate --set {key}={begun}")
        return [candidate.removeprefix(key + "=") for candidate in found]

    def options(self, line):
        # fish offers long options only after two dashes.
        return set(self.candidates(line)) | set(self.candidates(line + "-"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
