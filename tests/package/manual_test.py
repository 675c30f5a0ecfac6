"""Compares the manual page with the program's help: manual_test.py UNFLEX MANUAL"""

import re
import shutil
import subprocess
import sys
import unittest

import program_help

UNFLEX, MANUAL = sys.argv[1:3]
OPTION = r"(?<![\w-])--?[a-z][a-z0-9-]*"
HELP = {"-h", "--help", "--version"}


def plain(text):
    """Text of a man page without escapes: fonts, hyphens, spaces."""
    text = re.sub(r"\\f(\(..|\[.*?\]|.)", "", text)
    return text.replace(r"\-", "-").replace(r"\~", " ").replace(r"\&", "").replace('"', "")


class Manual(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(MANUAL, encoding="utf-8") as file:
            cls.text = file.read()
        cls.sections = dict(re.findall(r"^\.SH (.*)\n((?:(?!\.SH ).*\n)*)", cls.text, re.MULTILINE))
        cls.commands = program_help.commands(UNFLEX)

    def synopses(self):
        """The options in the synopsis of each command."""
        found = {}
        for block in re.findall(r"\.SY (.*?)\.YS", self.sections["SYNOPSIS"], re.DOTALL):
            words, _, rest = plain(block).partition("\n")
            found.setdefault(tuple(words.split()[1:]), set()).update(re.findall(OPTION, rest))
        return found

    def described(self):
        """Sets of names that are described together, each a set of names for one option."""
        tags = re.findall(r"^\.T[PQ]\n(.*)", self.sections["OPTIONS"], re.MULTILINE)
        return [frozenset(re.findall(OPTION, plain(tag).replace(" , ", " "))) for tag in tags]

    def test_synopsis_has_the_options_of_each_command_and_no_others(self):
        short = {name: names for names in self.described() for name in names}
        shown = {command: set().union(*(short.get(name, {name}) for name in options))
                 for command, options in self.synopses().items()}
        # A command that has subcommands has no synopsis.
        expected = {command: options - HELP for command, options in self.commands.items()
                    if not any(other[:-1] == command for other in self.commands if other)}
        expected[()] = HELP
        self.assertEqual(shown, expected)

    def test_every_option_is_described_once_and_nothing_else(self):
        names = [name for names in self.described() for name in names]
        self.assertEqual(sorted(names), sorted(set().union(*self.commands.values())))

    def test_every_command_is_described_and_nothing_else(self):
        tags = re.findall(r"^\.TP\n\.B (.*)", self.sections["COMMANDS"], re.MULTILINE)
        leaves = {" ".join(command) for command in self.commands
                  if not any(other[:-1] == command for other in self.commands if other)}
        self.assertEqual({plain(tag) for tag in tags}, leaves)

    def test_exit_statuses_are_those_of_the_help(self):
        in_help = re.search(r"Exit codes:(.*?)More", program_help.help_text(UNFLEX, ()), re.DOTALL)
        codes = re.findall(r"(\d) [a-z]", in_help.group(1))
        tags = re.findall(r"^\.TP\n\.B (\d)$", self.sections["EXIT STATUS"], re.MULTILINE)
        self.assertEqual(tags, codes)

    def complaints(self, *command):
        if not shutil.which(command[0]):
            self.skipTest(f"there is no {command[0]}")
        run = subprocess.run([*command, MANUAL], capture_output=True, text=True, check=False)
        return run.stderr

    def test_man_shows_the_page_without_warnings(self):
        self.assertEqual(self.complaints("man", "--local-file", "--warnings"), "")

    def test_groff_formats_the_page_without_warnings(self):
        self.assertEqual(self.complaints("groff", "-ww", "-man", "-Tutf8"), "")

    def test_mandoc_finds_nothing_to_say_of_the_page(self):
        if not shutil.which("mandoc"):
            self.skipTest("there is no mandoc")
        run = subprocess.run(["mandoc", "-T", "lint", MANUAL], capture_output=True, text=True,
                             check=False)
        self.assertEqual(run.stdout + run.stderr, "")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
