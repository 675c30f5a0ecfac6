"""Uploads through the hooks for print servers: hooks_test.py UNFLEX EXAMPLES

UNFLEX is the program, EXAMPLES the folder of the hooks. Each print goes its whole way, from the
upload to the file that would be printed.
"""

import http.server
import importlib.util
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest

UNFLEX, EXAMPLES = sys.argv[1:3]
SETTINGS = ["--set", "printer.firmware=klipper", "--set", "dynamics.x.freq_hz=45", "--set",
            "dynamics.y.freq_hz=45"]
PRINTER = """schema_version = 1
[printer]
firmware = "klipper"
[dynamics.x]
freq_hz = 45
[dynamics.y]
freq_hz = 45
"""


def sliced_print():
    lines = ["; sliced", "G28", "G90", "M83", "G1 X20 Y20 Z0.3 F6000"]
    for i in range(20):
        lines.append("G1 X{} Y{} E1 F3000".format(40 if i % 2 == 0 else 20, 20 + i))
    return "\n".join(lines + ["M104 S0", ""]).encode()


def compensated(folder):
    """What unflex itself makes of the print."""
    sliced = os.path.join(folder, "x.gcode")
    with open(sliced, "wb") as file:
        file.write(sliced_print())
    out = os.path.join(folder, "y.gcode")
    subprocess.run([UNFLEX, "compensate", "-q", *SETTINGS, sliced, "-o", out], check=True)
    with open(out, "rb") as file:
        return file.read()


class Folder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        self.whole = compensated(self.folder)
        self.printer = os.path.join(self.folder, "printer.toml")
        with open(self.printer, "w", encoding="utf-8") as file:
            file.write(PRINTER)

    def read(self, *path):
        with open(os.path.join(self.folder, *path), "rb") as file:
            return file.read()


class StreamWrapper:
    """An upload as OctoPrint hands it to plugins."""

    def __init__(self, filename, stream):
        self.filename = filename
        self._stream = stream

    def stream(self):
        return self._stream


class DiskFileWrapper:
    """A file that OctoPrint moves to where it is stored."""

    def __init__(self, filename, path, move=True):
        self.filename, self.path, self.move = filename, path, move

    def save(self, path):
        (shutil.move if self.move else shutil.copy2)(self.path, path)


def load_octoprint():
    """The plugin, with as much of OctoPrint as it needs."""
    modules = {name: types.ModuleType(name) for name in (
        "octoprint", "octoprint.filemanager", "octoprint.filemanager.util", "octoprint.plugin")}
    sys.modules.update(modules)
    modules["octoprint"].filemanager = modules["octoprint.filemanager"]
    modules["octoprint"].plugin = modules["octoprint.plugin"]
    modules["octoprint.filemanager"].valid_file_type = (
        lambda name, type: name.rsplit(".", 1)[-1].lower() in ("gcode", "gco", "g"))
    modules["octoprint.filemanager.util"].DiskFileWrapper = DiskFileWrapper
    for mixin in ("SettingsPlugin", "TemplatePlugin"):
        setattr(modules["octoprint.plugin"], mixin, type(mixin, (), {}))
    spec = importlib.util.spec_from_file_location(
        "octoprint_unflex", os.path.join(EXAMPLES, "octoprint", "octoprint_unflex", "__init__.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.__plugin_load__()
    return module


class Settings(dict):
    def get(self, path):
        return self[path[0]]


class OctoPrint(Folder):
    def setUp(self):
        super().setUp()
        module = load_octoprint()
        self.plugin = module.__plugin_implementation__
        self.plugin._settings = Settings(self.plugin.get_settings_defaults(), program=UNFLEX,
                                         printer=self.printer)
        self.hook = module.__plugin_hooks__["octoprint.filemanager.preprocessor"]

    def upload(self, name, content=None):
        """Stores the upload as OctoPrint does, and gives what is stored."""
        given = StreamWrapper(name, io.BytesIO(sliced_print() if content is None else content))
        got = self.hook(name, given, links=None, printer_profile=None, allow_overwrite=True)
        if got is given:
            return None
        self.assertEqual(got.filename, name)
        stored = os.path.join(self.folder, "stored.gcode")
        got.save(stored)
        self.assertFalse(os.path.exists(got.path))
        return self.read("stored.gcode")

    def test_stores_what_unflex_makes(self):
        self.assertEqual(self.upload("lid.gcode"), self.whole)

    def test_stores_a_print_as_sliced_where_unflex_fails(self):
        with self.assertLogs("octoprint_unflex", "ERROR") as logged:
            self.assertEqual(self.upload("lid.gcode", self.whole), self.whole)
        self.assertIn("already compensated", logged.output[0])
        self.plugin._settings["program"] = "/nowhere/unflex"
        with self.assertLogs("octoprint_unflex", "ERROR") as logged:
            self.assertEqual(self.upload("lid.gcode"), sliced_print())
        self.assertIn("cannot run /nowhere/unflex", logged.output[0])

    def test_leaves_other_files_and_names_alone(self):
        self.assertIsNone(self.upload("model.stl"))
        self.plugin._settings["names"] = "*unflex*"
        self.assertIsNone(self.upload("lid.gcode"))
        self.assertEqual(self.upload("a/lid_unflex.gcode"), self.whole)

    def test_passes_options(self):
        self.plugin._settings["options"] = "--set 'limits.max_acel_mm_s2=1'"
        with self.assertLogs("octoprint_unflex", "ERROR") as logged:
            self.assertEqual(self.upload("lid.gcode"), sliced_print())
        self.assertIn("max_acel_mm_s2", logged.output[0])


class Queue(http.server.BaseHTTPRequestHandler):
    """As much of Moonraker as the hook asks."""

    asked = []

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        Queue.asked.append((self.path, body))
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"{}")

    def log_message(self, *_):
        pass


class Moonraker(Folder):
    def setUp(self):
        super().setUp()
        Queue.asked.clear()
        self.gcodes = os.path.join(self.folder, "gcodes")
        os.mkdir(self.gcodes)
        server = http.server.HTTPServer(("127.0.0.1", 0), Queue)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        self.uploads = subprocess.Popen(
            [sys.executable, os.path.join(EXAMPLES, "moonraker", "unflex-uploads"), "--gcodes",
             self.gcodes, "--printer", self.printer, "--unflex", UNFLEX, "--pause", "0.1", "--queue",
             "--moonraker", "http://127.0.0.1:{}".format(server.server_port)],
            stdout=subprocess.PIPE, text=True)

    def tearDown(self):
        if self.uploads.poll() is None:
            self.uploads.send_signal(signal.SIGTERM)
        self.assertEqual(self.uploads.wait(10), 0)
        self.uploads.stdout.close()

    def wait_for(self, *path):
        end = time.monotonic() + 60
        while not os.path.exists(os.path.join(self.gcodes, *path)):
            self.assertLess(time.monotonic(), end, path)
            time.sleep(0.05)

    def upload(self, name, content):
        path = os.path.join(self.gcodes, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)

    def test_takes_marked_uploads_and_queues_what_comes_of_them(self):
        self.upload("other.gcode", sliced_print())
        self.upload("parts/lid.unflex.gcode", sliced_print())
        self.wait_for("parts", "lid.gcode")
        self.assertEqual(self.read("gcodes", "parts", "lid.gcode"), self.whole)
        end = time.monotonic() + 10
        while not Queue.asked and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(Queue.asked, [("/server/job_queue/job", {"filenames": ["parts/lid.gcode"]})])
        self.assertEqual(os.listdir(os.path.join(self.gcodes, "parts")), ["lid.gcode"])
        self.assertEqual(self.read("gcodes", "other.gcode"), sliced_print())

    def test_tells_what_fails_and_goes_on(self):
        self.upload("bad.unflex.gcode", self.whole)
        self.wait_for("bad.unflex.gcode.txt")
        self.upload("good.unflex.gcode", sliced_print())
        self.wait_for("good.gcode")
        self.assertIn(b"already compensated", self.read("gcodes", "bad.unflex.gcode.txt"))
        self.assertTrue(os.path.exists(os.path.join(self.gcodes, "bad.unflex.gcode")))
        self.assertFalse(os.path.exists(os.path.join(self.gcodes, "bad.gcode")))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
