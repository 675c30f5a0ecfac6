"""Reads a program's commands and options from its own help."""

import re
import subprocess


def help_text(program, command):
    """The help of a command, a tuple of words; () is the program itself."""
    return subprocess.run([program, *command, "--help"], check=True, capture_output=True,
                          text=True).stdout


def section(text, title):
    """The first words of the lines of a section of a help."""
    lines = re.search(rf"^{title}:\n((?:  .*\n)*)", text, re.MULTILINE)
    return re.findall(r"^  (\S+)", lines.group(1), re.MULTILINE) if lines else []


def commands(program, command=()):
    """All commands, with the options of each: {(): {"-h", …}, ("compensate",): {…}, …}."""
    text = help_text(program, command)
    found = {command: {name for names in section(text, "Options") for name in names.split(",")}}
    for name in section(text, "Subcommands"):
        found.update(commands(program, (*command, name)))
    return found
