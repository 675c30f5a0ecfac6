"""OctoPrint's plugin for unflex: what is uploaded is stored compensated.

OctoPrint hands each file to the plugin before it stores it. Where unflex fails, the print is stored
as it was sliced, and OctoPrint's log says why.
"""

import fnmatch
import logging
import os
import shlex
import shutil
import subprocess
import tempfile

import octoprint.filemanager
import octoprint.plugin
from octoprint.filemanager.util import DiskFileWrapper

__plugin_name__ = "unflex"
__plugin_version__ = "0.1.0"
__plugin_description__ = "Stores what is uploaded so that the nozzle draws the sliced path"
__plugin_pythoncompat__ = ">=3.7,<4"


class UnflexPlugin(octoprint.plugin.SettingsPlugin, octoprint.plugin.TemplatePlugin):
    def get_settings_defaults(self):
        return {"program": "unflex", "printer": "", "options": "", "names": "*"}

    def get_template_configs(self):
        return [{"type": "settings", "custom_bindings": False}]

    def compensate(self, path, file_object, *args, **kwargs):
        """The hook octoprint.filemanager.preprocessor: gives back what is to be stored."""
        if not self._is_wanted(path):
            return file_object
        folder = tempfile.mkdtemp(prefix="unflex-")
        try:
            sliced = os.path.join(folder, "print.gcode")
            compensated = os.path.join(folder, "compensated.gcode")
            with open(sliced, "wb") as file, file_object.stream() as stream:
                shutil.copyfileobj(stream, file)
            failure = self._run(sliced, compensated)
            if failure:
                logging.getLogger(__name__).error("%s is stored as sliced: %s", path, failure)
            os.rename(sliced if failure else compensated, folder + ".gcode")
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        # Storing it moves the file away.
        return DiskFileWrapper(file_object.filename, folder + ".gcode", move=True)

    def _is_wanted(self, path):
        is_print = octoprint.filemanager.valid_file_type(path, type="gcode")
        return is_print and fnmatch.fnmatch(os.path.basename(path), self._settings.get(["names"]))

    def _run(self, sliced, compensated):
        """What went wrong, or nothing."""
        printer = os.path.expanduser(self._settings.get(["printer"]).strip())
        command = [os.path.expanduser(self._settings.get(["program"]).strip()), "compensate",
                   "--quiet", *(["--printer", printer] if printer else []),
                   *shlex.split(self._settings.get(["options"])), "-o", compensated, sliced]
        try:
            done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, check=False)
        except OSError as error:
            return "cannot run {}: {}".format(command[0], error.strerror)
        if done.returncode == 0:
            return ""
        said = done.stderr.decode("utf-8", "replace").strip()
        return said or "unflex ended with exit code {}".format(done.returncode)


def __plugin_load__():
    global __plugin_implementation__, __plugin_hooks__
    __plugin_implementation__ = UnflexPlugin()
    __plugin_hooks__ = {
        "octoprint.filemanager.preprocessor": __plugin_implementation__.compensate,
    }
