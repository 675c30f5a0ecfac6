"""Cura's post-processing script for unflex: the print leaves Cura compensated.

Put this file into the folder "scripts" of Cura's configuration folder (Help > Show Configuration
Folder), start Cura anew, and add "Compensate with unflex" under Extensions > Post Processing >
Modify G-Code, behind all other scripts: they expect a print as it was sliced.
"""

import os
import shlex
import subprocess
import tempfile

from ..Script import Script


class UnflexCompensate(Script):
    def getSettingDataString(self):
        return """{
            "name": "Compensate with unflex",
            "key": "UnflexCompensate",
            "metadata": {},
            "version": 2,
            "settings":
            {
                "program":
                {
                    "label": "unflex",
                    "description": "The program: a path, or a name to be found in PATH. On Windows such as C:\\\\Users\\\\me\\\\unflex.exe.",
                    "type": "str",
                    "default_value": "unflex"
                },
                "printer":
                {
                    "label": "Printer",
                    "description": "What describes the printer: TOML, Klipper's printer.cfg, Marlin's answer to M503, or RepRapFirmware's config.g. Empty: the defaults and what Cura says.",
                    "type": "str",
                    "default_value": ""
                },
                "options":
                {
                    "label": "More options",
                    "description": "Options of unflex compensate, such as --set dynamics.x.freq_hz=52. Paths with spaces stand in double quotes.",
                    "type": "str",
                    "default_value": ""
                }
            }
        }"""

    def execute(self, data):
        """The compensated print, in as many strings as `data`; that is left as it is.

        Raises RuntimeError with unflex's message where it fails. Cura notes this in its log and
        goes on with the print as sliced, so that the message is shown as well.
        """
        if not data:
            return data
        text = "".join(data)
        try:
            compensated = self._compensate(text)
        except RuntimeError as error:
            _show(str(error))
            raise
        return _split_like(data, text, compensated)

    def _compensate(self, text):
        with tempfile.TemporaryDirectory(prefix="unflex-") as folder:
            sliced = os.path.join(folder, "print.gcode")
            compensated = os.path.join(folder, "compensated.gcode")
            _write(sliced, text)
            _run([self._program(), "compensate", "--quiet"] + self._options() +
                 ["-o", compensated, sliced])
            return _read(compensated)

    def _program(self):
        # A path that was copied from Windows' Explorer stands in quotes.
        return os.path.expanduser(self.getSettingValueByKey("program").strip().strip('"'))

    def _options(self):
        printer = self.getSettingValueByKey("printer").strip().strip('"')
        options = _words(self.getSettingValueByKey("options"))
        return (["--printer", os.path.expanduser(printer)] if printer else []) + options


def _is_windows():
    return os.name == "nt"


def _words(text):
    """The options as a shell takes them, on Windows with backslashes and ' as they are."""
    lexer = shlex.shlex(text, posix=True)
    lexer.whitespace_split = True
    lexer.commenters = ""
    if _is_windows():
        lexer.escape = ""
        lexer.quotes = '"'
    try:
        return list(lexer)
    except ValueError as error:
        raise RuntimeError("cannot read the options {}: {}; correct them in the script's settings"
                           .format(text, error)) from error


def _run(command):
    """Raises RuntimeError with what the command says where it fails."""
    try:
        # Cura has no console on Windows, so that the program would open one.
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, check=False,
                              creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0))
    except OSError as error:
        raise RuntimeError("cannot run {}: {}; set where unflex is in the script's settings"
                           .format(command[0], error.strerror)) from error
    if done.returncode != 0:
        said = done.stderr.decode("utf-8", "replace").strip()
        raise RuntimeError(said or "unflex ended with exit code {}".format(done.returncode))


# Cura's strings have only "\n" as line ends. Bytes in them that are no UTF-8 must come back as they
# were.
def _write(path, text):
    with open(path, "w", encoding="utf-8", errors="surrogateescape", newline="") as file:
        file.write(text)


def _read(path):
    with open(path, encoding="utf-8", errors="surrogateescape", newline="") as file:
        return file.read()


def _show(message):
    """On the screen, where there is Cura's."""
    try:
        from UM.Message import Message
    except ImportError:
        return
    Message("The print is not compensated. " + message, title="unflex", lifetime=0).show()


def _is_mark(line):
    # unflex keeps all lines except moves and lines that tell the time.
    return line.startswith((";", "M"))


def _split_like(data, sliced, compensated):
    """`compensated` in len(data) strings that begin where those of `data` do.

    Each of data's strings is found again by its first line that is no move and stands in both texts
    as often: for layers that is ";LAYER:n". A string that has none is empty, and what was in it
    stands at the end of the one before.
    """
    before = _places(sliced)
    after = _places(compensated)
    parts = []
    offset, end = len(sliced), len(compensated)
    for part in reversed(data[1:]):
        offset -= len(part)
        start = min(end, _start_of(part, offset, before, after, otherwise=end))
        parts.append(compensated[start:end])
        end = start
    return [compensated[:end]] + parts[::-1]


def _places(text):
    """Of each line that is a mark, the offsets at which it stands."""
    places = {}
    offset = 0
    for line in text.splitlines(keepends=True):
        if _is_mark(line):
            places.setdefault(line, []).append(offset)
        offset += len(line)
    return places


def _start_of(part, offset, before, after, otherwise):
    for line in part.splitlines(keepends=True):
        if _is_mark(line) and len(before[line]) == len(after.get(line, [])):
            return after[line][before[line].index(offset)]
        offset += len(line)
    return otherwise
