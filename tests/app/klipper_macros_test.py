#!/usr/bin/env python3
"""klipper_macros_test.py UNFLEX

Runs the macros of `unflex printer macros` with Jinja2, as Klipper does, in a printer that knows
little more than limits, shaper and the file it prints (klippy/extras/gcode_macro.py,
virtual_sdcard.py, pause_resume.py).
"""

import ast
import re
import shlex
import subprocess
import sys
import unittest

try:
    import jinja2
except ImportError:
    print("skipped: there is no Jinja2")
    sys.exit(77)

UNFLEX = sys.argv.pop(1)
OWN_LIMITS = {"VELOCITY": 300.0, "ACCEL": 5000.0, "SQUARE_CORNER_VELOCITY": 5.0,
              "MINIMUM_CRUISE_RATIO": 0.5}
RAISED = "VELOCITY=1200 ACCEL=1000000 SQUARE_CORNER_VELOCITY=1000 MINIMUM_CRUISE_RATIO=0"
RESTORED = " ".join(f"{word}={value}" for word, value in OWN_LIMITS.items())

# A run with an acceleration of the file's own inside, then motion behind it.
PRINT = ["G28",
         "SET_INPUT_SHAPER SHAPER_FREQ_X=0",
         "UNFLEX_CHECKPOINT RUN=1 SHAPER_FREQ_X=45",
         ";unflex run",
         "SET_VELOCITY_LIMIT " + RAISED,
         "G1 X1",
         "M204 S4000",
         "UNFLEX_LIMITS ACCEL=1000000",
         "G1 X2",
         ";unflex end",
         "SET_VELOCITY_LIMIT " + RESTORED.replace("ACCEL=5000.0", "ACCEL=4000"),
         "UNFLEX_CHECKPOINT SHAPER_FREQ_X=45",
         "G1 X3"]


class Macro:
    def __init__(self, name, section):
        self.name = name
        options = re.split(r"^(\w+):", section, flags=re.M)[1:]
        self.variables = {}
        for option, value in zip(options[::2], options[1::2]):
            if option.startswith("variable_"):
                self.variables[option.removeprefix("variable_")] = ast.literal_eval(value.strip())
            elif option == "gcode":
                self.template = jinja2.Environment("{%", "%}", "{", "}").from_string(value)
            elif option == "rename_existing":
                self.base = value.strip()


def read_macros():
    text = subprocess.run([UNFLEX, "printer", "macros", "-o", "-"], capture_output=True, text=True,
                          check=True).stdout
    text = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#"))
    parts = re.split(r"^\[gcode_macro (\w+)\]\n", text, flags=re.M)[1:]
    return [Macro(name, section) for name, section in zip(parts[::2], parts[1::2])]


class Printer:
    def __init__(self):
        self.limits = dict(OWN_LIMITS)
        self.shaper_x_hz = 45.0
        self.is_paused = False
        self.card = {"is_active": False, "file_size": 0, "file_position": 0}
        self.lines = []
        self.done = []   # what the base commands did, in order
        self.moves = []  # each move and the acceleration it was queued with
        self.macros = {}
        self.base = {}
        for macro in read_macros():
            self.macros[macro.name.upper()] = macro
            if hasattr(macro, "base"):
                self.base[macro.base] = macro.name.upper()

    def status(self):
        own = {"configfile": {"settings": {"printer": {
                   "max_velocity": OWN_LIMITS["VELOCITY"], "max_accel": OWN_LIMITS["ACCEL"],
                   "square_corner_velocity": OWN_LIMITS["SQUARE_CORNER_VELOCITY"],
                   "minimum_cruise_ratio": OWN_LIMITS["MINIMUM_CRUISE_RATIO"]},
                   "extruder": {"pressure_advance": 0.04,
                                "pressure_advance_smooth_time": 0.03}}},
               "toolhead": {"extruder": "extruder",
                            "max_velocity": self.limits["VELOCITY"],
                            "max_accel": self.limits["ACCEL"],
                            "square_corner_velocity": self.limits["SQUARE_CORNER_VELOCITY"],
                            "minimum_cruise_ratio": self.limits["MINIMUM_CRUISE_RATIO"]},
               "pause_resume": {"is_paused": self.is_paused}, "virtual_sdcard": dict(self.card)}
        for macro in self.macros.values():
            own["gcode_macro " + macro.name] = dict(macro.variables)
        return own

    def run(self, line):
        line = line.split(";")[0].strip()
        if not line:
            return
        command, _, rest = line.partition(" ")
        command = command.upper()
        if command in self.macros:
            macro = self.macros[command]
            # Variables are read when the text is made, before any of its commands is run.
            text = macro.template.render(
                {**macro.variables, "printer": self.status(), "rawparams": rest,
                 "params": self.words(rest),
                 "action_respond_info": lambda message: ""})
            for line in text.splitlines():
                self.run(line)
            return
        self.carry_out(self.base.get(command, command), rest)

    @staticmethod
    def words(rest):
        return dict(word.partition("=")[::2] for word in shlex.split(rest))

    def carry_out(self, command, rest):
        if command == "SET_GCODE_VARIABLE":
            words = self.words(rest)
            variables = self.macros[words["MACRO"].upper()].variables
            assert words["VARIABLE"] in variables, rest
            variables[words["VARIABLE"]] = ast.literal_eval(words["VALUE"])
            return
        self.done.append((command, rest))
        if command == "SET_VELOCITY_LIMIT":
            self.limits.update({word: float(value) for word, value in self.words(rest).items()})
        elif command == "SET_INPUT_SHAPER":
            self.shaper_x_hz = float(self.words(rest)["SHAPER_FREQ_X"])
        elif command == "M204":
            self.limits["ACCEL"] = float(rest[1:])
        elif command == "G1":
            self.moves.append((rest, self.limits["ACCEL"]))
        elif command == "PAUSE":
            # Parking moves the head.
            self.is_paused = True
            self.card["is_active"] = False
            self.moves.append(("park", self.limits["ACCEL"]))
        elif command == "RESUME":
            self.is_paused = False
            self.card["is_active"] = True
        elif command == "CANCEL_PRINT":
            self.card.update(is_active=False, file_size=0, file_position=0)

    def start(self, lines):
        self.lines = list(lines)
        self.card = {"is_active": True, "file_size": sum(len(line) + 1 for line in lines),
                     "file_position": 0}

    def print_until(self, line):
        """Prints up to and including the line, or until the file stops."""
        while self.lines and self.card["is_active"]:
            text = self.lines.pop(0)
            self.run(text)
            if self.card["file_size"]:
                self.card["file_position"] += len(text) + 1
            if text == line:
                return

    def print_all(self):
        self.print_until(None)


class Macros(unittest.TestCase):
    def setUp(self):
        self.printer = Printer()

    def test_do_nothing_without_a_pause(self):
        self.printer.start(PRINT)
        self.printer.print_all()
        self.assertEqual(self.printer.moves,
                         [("X1", 1000000.0), ("X2", 1000000.0), ("X3", 4000.0)])
        own = [line for line in PRINT if line.startswith(("SET_VELOCITY", "SET_INPUT", "G", "M"))]
        own.insert(5, "SET_VELOCITY_LIMIT ACCEL=1000000")
        self.assertEqual([" ".join(done).strip() for done in self.printer.done], own)

    def test_let_a_pause_wait_for_the_end_of_the_run(self):
        self.printer.start(PRINT)
        self.printer.print_until("G1 X1")
        self.printer.run("PAUSE")
        self.assertFalse(self.printer.is_paused)
        self.printer.print_all()
        self.assertTrue(self.printer.is_paused)
        self.assertEqual(self.printer.moves[1:], [("X2", 1000000.0), ("park", 5000.0)])
        self.assertEqual(self.printer.shaper_x_hz, 45.0)
        self.printer.run("RESUME")
        self.assertEqual(self.printer.shaper_x_hz, 0.0)
        self.printer.print_all()
        self.assertEqual(self.printer.moves[-1], ("X3", 4000.0))

    def test_call_off_a_pause_that_has_not_come(self):
        self.printer.start(PRINT)
        self.printer.print_until("G1 X1")
        self.printer.run("PAUSE")
        self.printer.run("RESUME")
        self.printer.print_all()
        self.assertFalse(self.printer.is_paused)
        self.assertEqual(len(self.printer.moves), 3)

    def test_keep_the_printers_limits_in_the_rest_of_an_interrupted_run(self):
        for before in ["SET_VELOCITY_LIMIT " + RAISED, "G1 X1", "M204 S4000"]:
            with self.subTest(before=before):
                self.printer = Printer()
                self.printer.start(PRINT)
                self.printer.print_until(before)
                self.printer.run("PAUSE NOW=1")
                self.assertTrue(self.printer.is_paused)
                self.assertEqual(self.printer.moves[-1], ("park", 5000.0))
                self.printer.run("RESUME")
                self.printer.print_until("G1 X2")
                self.assertLessEqual(self.printer.moves[-1][1], 5000.0)
                self.printer.print_all()
                self.assertEqual(self.printer.moves[-1], ("X3", 4000.0))
                # The next run is whole again.
                self.printer.start(PRINT)
                self.printer.print_all()
                self.assertEqual(self.printer.moves[-2], ("X2", 1000000.0))

    def test_forget_a_print_that_died_inside_a_run(self):
        for dies_behind in ["G1 X1", "M204 S4000"]:
            for asked in ["PAUSE", "CANCEL_PRINT"]:
                with self.subTest(dies_behind=dies_behind, asked=asked):
                    self.printer = Printer()
                    self.printer.start(PRINT)
                    self.printer.print_until(dies_behind)
                    self.printer.limits = dict(OWN_LIMITS)  # by on_error_gcode
                    self.printer.start(PRINT)
                    self.printer.print_until("G28")
                    self.printer.run(asked)
                    self.assertFalse(self.printer.card["is_active"])
                    self.assertEqual(self.printer.done[-1][0], asked)

    def test_put_limits_shaper_and_advance_back_for_a_cancel_inside_a_run(self):
        self.printer.start(PRINT)
        self.printer.print_until("G1 X1")
        self.printer.run("CANCEL_PRINT NOW=1")
        self.assertEqual(self.printer.limits, OWN_LIMITS)
        self.assertEqual(self.printer.shaper_x_hz, 45.0)
        self.assertIn(("SET_PRESSURE_ADVANCE", "ADVANCE=0.04 SMOOTH_TIME=0.03"),
                      self.printer.done)


if __name__ == "__main__":
    unittest.main()
