"""Cura's post-processing script for unflex: the print leaves Cura compensated.

Put this file into the folder "scripts" of Cura's configuration folder (Help > Show Configuration
Folder), start Cura anew, and add "Compensate with unflex" under Extensions > Post Processing >
Modify G-Code, behind all other scripts: they expect a print as it was sliced.

On Windows unflex runs in WSL, which the script starts. Paths may be those of Windows or of WSL.
"""

import os
import re
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
                    "description": "The program: a path, or a name to be found in PATH. On Windows a path in WSL, such as /home/me/unflex.",
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
            _unflex(self._program(),
                    ["compensate", "--quiet"] + self._options() + ["-o", compensated, sliced])
            return _read(compensated)

    def _program(self):
        return self.getSettingValueByKey("program").strip()

    def _options(self):
        # A path that was copied from Windows' Explorer stands in quotes.
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


def _unflex(program, arguments):
    if not _is_windows():
        return _run([os.path.expanduser(program)] + arguments)
    wsl = _Wsl()
    # Without --exec a shell of WSL would read the arguments once more.
    words = ["--exec"] + [wsl.argument(word) for word in [program] + arguments]
    return _run(wsl.command() + words)


def _run(command):
    """What the command writes to stdout. Raises RuntimeError with what it says where it fails."""
    try:
        # By WSL_UTF8 wsl.exe writes its own messages as unflex does; and Cura has no console, so
        # that wsl.exe would open one.
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, check=False,
                              env=dict(os.environ, WSL_UTF8="1"),
                              creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0))
    except OSError as error:
        what = ("install WSL and unflex in it" if _is_windows()
                else "set where unflex is in the script's settings")
        raise RuntimeError("cannot run {}: {}; {}"
                           .format(command[0], error.strerror, what)) from error
    if done.returncode != 0:
        # wsl.exe writes some messages to stdout.
        said = _text(done.stderr) or _text(done.stdout)
        if "execvpe(" in said:
            said += "; set where unflex is in WSL in the script's settings"
        raise RuntimeError(said or "unflex ended with exit code {}".format(done.returncode))
    return _text(done.stdout)


def _text(said):
    # wsl.exe of before WSL_UTF8 writes UTF-16.
    return said.decode("utf-16-le" if b"\0" in said else "utf-8", "replace").strip()


class _Wsl:
    """Windows' paths as WSL has them, and the distribution that they are in."""

    def __init__(self):
        self._roots = {}
        self._distribution = None

    def command(self):
        """How to start WSL; to be asked once all paths are known."""
        return ["wsl.exe"] + (["--distribution", self._distribution] if self._distribution else [])

    def argument(self, word):
        """The word with a path in it, if it is one or an option with one, as WSL has it."""
        option = re.match(r"--[\w-]+=", word)
        begin = option.end() if option else 0
        return word[:begin] + self._path(word[begin:])

    def _path(self, path):
        slashed = path.replace("\\", "/")
        if re.match(r"[A-Za-z]:/", slashed):
            return self._root(slashed[:1].upper()) + slashed[2:]
        inside = re.match(r"//(?:wsl\$|wsl\.localhost)/([^/]+)(.*)", slashed, re.IGNORECASE)
        if inside:
            self._enter(inside.group(1))
            return inside.group(2) or "/"
        if path.startswith("\\\\"):
            raise RuntimeError("{} is in a network folder, which WSL does not see; copy it to a "
                               "drive of this computer".format(path))
        return path

    def _enter(self, distribution):
        if self._distribution not in (None, distribution):
            raise RuntimeError("{} and {} are two distributions of WSL; give paths in one of them"
                               .format(self._distribution, distribution))
        self._distribution = distribution

    def _root(self, drive):
        # WSL can be told to have the drives elsewhere than in /mnt.
        if drive not in self._roots:
            asked = self.command() + ["--exec", "wslpath", "-a", drive + ":/"]
            self._roots[drive] = _run(asked).rstrip("/")
        return self._roots[drive]


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
