"""The page of one file in a real Chromium: page_test.py UNFLEX PAGE DATA

UNFLEX is the program of this machine, whose bytes the page's must be; PAGE is unflex.html; DATA the
folder of test data. Exit code 77 where there is no browser or no page.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
import unittest

import chromium

UNFLEX, PAGE, DATA = (os.path.abspath(path) for path in sys.argv[1:4])
MOST_BYTES = 1_500_000
CONFIGURATION = """[printer]
kinematics: cartesian
max_velocity: 300
max_accel: 5000
[include shaper.cfg]
[stepper_x]
position_max: 250
[stepper_y]
position_max: 210
"""
SHAPER = "[input_shaper]\nshaper_freq_x: 45\nshaper_freq_y: 38\nshaper_type: zv\n"


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = chromium.Chromium(timeout_s=240)
        cls.folder = tempfile.TemporaryDirectory()
        cls.write("printer.cfg", CONFIGURATION)
        cls.write("shaper.cfg", SHAPER)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.folder.cleanup()

    @classmethod
    def write(cls, name, text):
        path = os.path.join(cls.folder.name, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def setUp(self):
        self.open()
        self.run_script("localStorage.clear()")
        self.open()

    def tearDown(self):
        self.assertEqual([said for said in self.browser.complaints() if "blob:" not in said], [])

    def open(self):
        self.browser.open(PAGE)
        self.browser.wait_for("document.title === 'unflex'")

    def run_script(self, script):
        return self.browser.run(script)

    def choose(self, element, *paths):
        root = self.browser.call("DOM.getDocument")["root"]["nodeId"]
        node = self.browser.call("DOM.querySelector", nodeId=root, selector="#" + element)["nodeId"]
        self.browser.call("DOM.setFileInputFiles", nodeId=node, files=list(paths))

    def show(self, tab):
        self.run_script("document.getElementById('tab-{}').click()".format(tab))

    def add_printer(self):
        self.show("printer")
        self.choose("printer-files", *(os.path.join(self.folder.name, name)
                                       for name in ("shaper.cfg", "printer.cfg")))
        self.browser.wait_for("document.querySelector('#printer-list .card') !== null")

    def text(self, element):
        return self.run_script("document.getElementById('{}').innerText".format(element))

    def test_is_small_and_quickly_there(self):
        self.assertLessEqual(os.path.getsize(PAGE), MOST_BYTES)
        self.open()
        painted_ms = self.run_script(
            "new Promise((done) => new PerformanceObserver((list) => "
            "done(list.getEntries()[0].startTime)).observe({type: 'paint', buffered: true}))")
        print("first view after {:.0f} ms, {} bytes".format(painted_ms, os.path.getsize(PAGE)))
        self.assertLess(painted_ms, 1000)

    def test_knows_a_printer_by_its_configuration_and_keeps_it(self):
        self.add_printer()
        self.assertIn("X 44.6 Hz, Y 37.6 Hz", self.text("printer-list"))
        self.open()
        self.show("printer")
        self.assertIn("X 44.6 Hz, Y 37.6 Hz", self.text("printer-list"))

    def test_tells_why_a_printer_cannot_be_helped(self):
        self.show("printer")
        self.choose("printer-files", self.write("delta.cfg", "[printer]\nkinematics: delta\n"
                                                "max_velocity: 300\nmax_accel: 3000\n"))
        self.browser.wait_for("document.querySelector('#printer-status .messages') !== null")
        self.assertIn("does not support kinematics 'delta' yet", self.text("printer-status"))

    def compensated(self, options=()):
        """What unflex itself makes of the print."""
        toml = os.path.join(self.folder.name, "printer.toml")
        subprocess.run([UNFLEX, "printer", "init", "--from",
                        os.path.join(self.folder.name, "printer.cfg"), "-o", toml, "-q"], check=True)
        out = os.path.join(self.folder.name, "out.gcode")
        subprocess.run([UNFLEX, "compensate", self.sliced, "-o", out, "--printer", toml, "-q",
                        *options], check=True)
        with open(out, "rb") as file:
            return hashlib.sha256(file.read()).hexdigest()

    sliced = os.path.join(DATA, "pipeline_washer_arcs.gcode")

    def hash_of_result(self):
        self.browser.wait_for("document.querySelector('#jobs a.primary, #jobs .messages') !== null")
        return self.run_script("""(async () => {
          const link = document.querySelector('#jobs a.primary');
          if (!link) return document.getElementById('jobs').innerText;
          const bytes = await (await fetch(link.href)).arrayBuffer();
          const hash = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
          return [...hash].map((byte) => byte.toString(16).padStart(2, '0')).join('');
        })()""")

    def test_gives_the_bytes_of_the_program(self):
        self.add_printer()
        self.show("print")
        self.choose("print-files", self.sliced)
        self.assertEqual(self.hash_of_result(), self.compensated())
        self.assertIn("Better?", self.text("jobs"))
        self.run_script("[...document.querySelectorAll('#jobs button')].find((b) => b.innerText === 'Report').click()")
        self.browser.wait_for("document.querySelector('#page-dialog iframe').srcdoc.includes('</html>')")

    def test_gives_the_bytes_of_the_program_where_timing_is_free(self):
        self.add_printer()
        self.show("print")
        self.run_script("document.getElementById('faster').click(), document.getElementById('tolerance').value = 40")
        self.choose("print-files", self.sliced)
        self.assertEqual(self.hash_of_result(), self.compensated(["--faster=40"]))

    def test_asks_for_a_printer_first(self):
        self.choose("print-files", self.sliced)
        self.browser.wait_for("document.getElementById('print-status').innerText.includes('First tell')")

    def test_shows_messages_for_what_is_no_print(self):
        self.add_printer()
        self.show("print")
        self.choose("print-files", self.write("bad.gcode", "\0\0\0"))
        self.browser.wait_for("document.querySelector('#jobs .messages') !== null")
        self.assertIn("The print stays as it is.", self.text("jobs"))

    def test_cancels(self):
        self.add_printer()
        self.show("print")
        with open(self.sliced, encoding="utf-8") as file:
            self.choose("print-files", self.write("long.gcode", 60 * file.read()))
        self.browser.wait_for("document.querySelector('#jobs progress')?.value > 0")
        self.run_script("document.querySelector('#jobs button').click()")
        self.browser.wait_for("document.getElementById('jobs').innerText.includes('cancelled')")

    def test_tries_how_fast_a_print_may_go(self):
        self.add_printer()
        self.show("print")
        self.choose("faster-file", self.sliced)
        self.browser.wait_for("document.getElementById('faster-status').textContent.includes('first four layers')")
        self.assertEqual(self.run_script("document.querySelectorAll('#faster-curve circle').length"), 5)

    def test_reads_records(self):
        self.add_printer()
        self.show("measure")
        spectra = os.path.join(DATA, "spectra")
        name = sorted(name for name in os.listdir(spectra) if "_x" in name and name.endswith(".csv"))[0]
        self.choose("measure-files", os.path.join(spectra, name))
        self.browser.wait_for("document.querySelector('#measure-status button, #measure-status .messages') !== null")
        self.assertIn("Hz", self.text("measure-status"))
        self.run_script("document.querySelector('#measure-status button').click()")
        self.browser.wait_for("document.querySelector('#measure-status .good') !== null")

    def test_makes_and_reads_a_tower(self):
        self.add_printer()
        self.show("tune")
        self.run_script("document.getElementById('tower-make').click()")
        self.browser.wait_for("document.querySelectorAll('.wall').length === 2")
        self.run_script("for (const band of document.querySelectorAll("
                        "'[aria-label=\"Band 13\"], [aria-label=\"Band 18\"]')) band.click()")
        self.run_script("document.getElementById('tower-read').click()")
        self.browser.wait_for("document.querySelector('#tower-status pre')?.innerText.includes('damping ratios')")
        self.assertIn("x: 42.52 Hz", self.text("tower-status"))
        self.browser.wait_for("document.querySelector('#tower-status a.primary') !== null")
        self.show("printer")
        self.assertIn("X 42.525 Hz, Y 35.85", self.text("printer-list"))

    def test_shows_a_corner(self):
        self.show("corner")
        self.browser.wait_for("document.getElementById('corner-told').innerText.includes('with unflex')")
        before, after = [float(part) for part in self.run_script(
            "document.getElementById('corner-told').innerText.match(/[0-9.]+ µm/g).map(parseFloat)")]
        self.assertLess(after, before / 4)

    def test_is_worked_by_the_keyboard(self):
        self.run_script("document.getElementById('tab-print').focus()")
        for key in ("ArrowRight", "ArrowRight", "End", "Home", "ArrowLeft"):
            self.browser.key(key)
        self.assertEqual(self.run_script("document.activeElement.id"), "tab-commands")
        self.assertEqual(self.run_script("[...document.querySelectorAll('[role=tabpanel]')].filter((p) => !p.hidden).map((p) => p.id).join()"), "panel-commands")

    def test_names_all_that_can_be_worked(self):
        nodes = self.browser.call("Accessibility.getFullAXTree")["nodes"]
        for node in nodes:
            role = node.get("role", {}).get("value")
            if role in ("button", "link", "textbox", "combobox", "slider", "radio", "tab", "spinbutton"):
                self.assertTrue(node.get("name", {}).get("value"), node)

    def test_fits_a_phone(self):
        for dark in (False, True):
            self.browser.window(390, 844, phone=True, dark=dark)
            for tab in ("print", "printer", "measure", "tune", "corner", "commands"):
                self.show(tab)
                self.assertLessEqual(self.run_script("document.documentElement.scrollWidth"), 390, tab)
        self.browser.window(1280, 800)


if __name__ == "__main__":
    if not chromium.find() or not os.path.exists(PAGE):
        print("skipped: no Chromium, or the page is not built")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1] + sys.argv[4:], verbosity=2)
