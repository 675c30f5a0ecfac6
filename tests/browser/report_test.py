"""The HTML report in a real browser: report_test.py UNFLEX DATA

UNFLEX is the program, DATA the folder of the tests' G-code. Exits with 77, which skips the test,
where there is no Chromium.
"""

import json
import os
import subprocess
import sys
import tempfile
import unittest

import chromium

UNFLEX, DATA = sys.argv[1:3]
COMPLETE = "performance.getEntriesByName('unflex-complete').length > 0"
HOSTILE = "</script><script>window.pwned = 1</script><img src=x onerror=\"window.pwned = 1\">'&amp;"


def make_report(folder, name, text):
    """The path of the report of a print with this name and text."""
    source = os.path.join(folder, name)
    with open(source, "w", encoding="utf-8") as file:
        file.write(text)
    page = os.path.join(folder, "report.html")
    subprocess.run([UNFLEX, "compensate", source, "-o", os.path.join(folder, "out.gcode"), "-q",
                    "--engine", "banded", "--set", "dynamics.x.freq_hz=45", "--set",
                    "dynamics.y.freq_hz=45", "--report", page], check=True)
    return page


class Report(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        with open(os.path.join(DATA, "pipeline_bracket.gcode"), encoding="utf-8") as file:
            cls.text = file.read()
        cls.page = make_report(cls.folder.name, "bracket.gcode", cls.text)
        cls.browser = chromium.Chromium()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.folder.cleanup()

    def setUp(self):
        self.open(1366, 820)

    def tearDown(self):
        self.assertEqual(self.browser.complaints(), [])

    def open(self, width, height, page=None, **look):
        self.browser.window(width, height, **look)
        self.browser.open(page or self.page)
        self.browser.wait_for(COMPLETE)

    def run_js(self, script):
        return self.browser.run(script)

    def state(self):
        return self.run_js("(({layer, x, y, scale}) => ({layer, x, y, scale}))"
                           "(unflexReport.view.state)")

    def picture(self, canvas="view-before"):
        """What tells one picture from another."""
        self.run_js("unflexReport.view.draw()")
        return self.run_js(f"document.getElementById('{canvas}').toDataURL()")

    def focus(self, selector):
        self.run_js(f"document.querySelector({json.dumps(selector)}).focus()")

    def test_first_view_says_what_was_gained_and_how_robust_it_is(self):
        answers = self.run_js("[...document.querySelectorAll('.answer')].map(a => a.textContent)")
        self.assertEqual(len(answers), 3)
        self.assertRegex(answers[0], r"Better\?\s+[\d.]+ → [\d.]+ µm off the path")
        self.assertRegex(answers[0], "if the frequencies are 5 % off")
        self.assertRegex(answers[1], r"In line \d+, layer \d+")
        self.assertRegex(answers[2], "yes, every rule is kept")
        self.assertRegex(answers[2], "times the printer's own limit of")
        box = self.run_js("(b => [b.top, b.bottom])"
                          "(document.getElementById('sensitivity').getBoundingClientRect())")
        self.assertLess(box[0], 620)
        self.assertLess(box[1], 1000)
        texts = self.run_js("[...document.querySelectorAll('#sensitivity text')].map(t => t.textContent)")
        self.assertLessEqual({"designed for ±10 %", "as sliced", "unflex", "ZV", "MZV", "EI",
                              "-15 %", "+15 %"}, set(texts))
        self.assertGreater(self.run_js("document.querySelector('#sensitivity rect.band')"
                                       ".getBoundingClientRect().width"), 100)
        for canvas in ("view-before", "view-after"):
            blank = self.run_js(
                f"(() => {{ const c = document.getElementById('{canvas}');"
                "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
                "return new Set(new Uint32Array(d.buffer)).size; })()")
            self.assertGreater(blank, 20)
        self.assertNotEqual(self.picture("view-before"), self.picture("view-after"))

    def test_answers_are_above_the_fold(self):
        for width, height, phone in ((1366, 768, False), (390, 844, True)):
            self.open(width, height, phone=phone)
            lowest = self.run_js("Math.max(...[...document.querySelectorAll('.answer')]"
                                 ".map(a => a.getBoundingClientRect().bottom))")
            self.assertLess(lowest, height)

    def test_labels_of_the_scale_stand_apart(self):
        for width, phone in ((1366, False), (390, True)):
            self.open(width, 844, phone=phone)
            gaps = self.run_js("(boxes => boxes.slice(1).map((b, i) => b.left - boxes[i].right))"
                               "([...document.querySelectorAll('#scale-ticks span')]"
                               ".map(t => t.getBoundingClientRect()))")
            self.assertGreater(len(gaps), 1)
            self.assertGreaterEqual(min(gaps), 3)

    def test_layer_slider_changes_the_layer(self):
        layers = self.run_js("unflexReport.data.layers.length")
        self.assertGreater(layers, 1)
        self.focus("#layer")
        self.browser.key("Home")
        self.assertEqual(self.state()["layer"], 0)
        lowest = self.picture()
        self.browser.key("ArrowRight")
        self.assertEqual(self.state()["layer"], 1)
        self.assertNotEqual(self.picture(), lowest)
        start = self.run_js("unflexReport.data.start_layers")
        self.assertIn(f"Layer {2 - start} of {layers - start}",
                      self.run_js("document.getElementById('layer-name').textContent"))
        self.browser.click_on("#layer-down")
        self.assertEqual(self.state()["layer"], 0)
        self.assertEqual(self.picture(), lowest)

    def test_zoom_works_by_button_wheel_and_key(self):
        whole = self.state()["scale"]
        before = self.picture()
        self.browser.click_on("#zoom-in")
        self.assertGreater(self.state()["scale"], 1.3 * whole)
        self.assertNotEqual(self.picture(), before)
        self.browser.click_on("#zoom-fit")
        self.assertEqual(self.state()["scale"], whole)
        self.assertEqual(self.picture(), before)

        self.focus("#view-after")
        self.browser.key("+")
        self.assertGreater(self.state()["scale"], 1.2 * whole)
        x = self.state()["x"]
        self.browser.key("ArrowRight")
        self.assertGreater(self.state()["x"], x)
        self.browser.key("0")
        self.assertEqual(self.state()["scale"], whole)

        self.run_js("document.getElementById('view-before').scrollIntoView({block: 'center'})")
        box = self.run_js("(b => [b.x + 50, b.y + 50])"
                          "(document.getElementById('view-before').getBoundingClientRect())")
        self.focus("#view-before")
        self.browser.wheel(*box, -300)
        self.browser.wait_for(f"unflexReport.view.state.scale > 1.2 * {whole}")

    def test_page_scrolls_over_a_picture_that_is_not_chosen(self):
        whole = self.state()["scale"]
        self.browser.wheel(300, 600, 200)
        self.browser.wait_for("scrollY > 50")
        self.assertEqual(self.state()["scale"], whole)

    def test_worst_place_is_on_screen_after_its_click(self):
        for number, name in enumerate(("worst-before", "worst-after")):
            self.run_js("scrollTo(0, 0)")
            self.browser.click_on(f"#{name} li:first-child button")
            self.browser.wait_for("document.getElementById('print').getBoundingClientRect().top < 40")
            place = self.run_js(
                f"(({{line, layer, at, um}}) => ({{line, layer, at, um}}))(unflexReport.data.worst[{number}][0])")
            self.assertEqual(self.state()["layer"], place["layer"])
            x, y = self.run_js(f"unflexReport.view.toScreen({place['at'][0]}, {place['at'][1]})")
            for canvas in ("view-before", "view-after"):
                box = self.run_js("(b => [b.x, b.y, b.right, b.bottom])"
                                  f"(document.getElementById('{canvas}').getBoundingClientRect())")
                self.assertTrue(box[0] < box[0] + x < min(box[2], 1366))
                self.assertTrue(0 < box[1] + y < min(box[3], 820))
            note = self.run_js("document.getElementById('moment-note').textContent")
            self.assertIn(f"Line {place['line']},", note)
            for plot in ("plane", "deviation-plot", "velocity-plot", "acceleration-plot"):
                curves = self.run_js(
                    f"[...document.querySelectorAll('#{plot} svg path')].map(p => p.getAttribute('d').length)")
                self.assertGreaterEqual(len(curves), 2)
                self.assertGreater(min(curves), 100)

    def test_worst_places_agree_with_the_figures_above(self):
        most = self.run_js("[2, 4].map(k => Math.max(...unflexReport.data.layers"
                           ".slice(unflexReport.data.start_layers).map(row => row[k + 1])))")
        self.assertEqual(self.run_js("unflexReport.data.worst[0][0].um[0]"), most[0])
        self.assertEqual(self.run_js("unflexReport.data.worst[1][0].um[1]"), most[1])

    def test_pointing_at_a_line_tells_its_deviation(self):
        self.browser.click_on("#worst-before li:first-child button")
        self.browser.wait_for("document.getElementById('print').getBoundingClientRect().top < 40")
        x, y = self.run_js("(p => (b => (s => [b.x + s[0], b.y + s[1]])(unflexReport.view.toScreen(...p.at)))"
                           "(document.getElementById('view-before').getBoundingClientRect()))"
                           "(unflexReport.data.worst[0][0])")
        self.browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        self.assertRegex(self.run_js("document.getElementById('readout').textContent"),
                         r".+, lines? \d+.*: [\d.]+\sµm before, [\d.]+\sµm after")

    def test_everything_can_be_reached_by_keyboard(self):
        reached = set()
        for _ in range(60):
            self.browser.key("Tab")
            reached.add(self.run_js("(e => (e.closest('[id]') || e).id)(document.activeElement)"))
        self.assertLessEqual({"theme", "view-before", "view-after", "layer", "layer-up", "zoom-in",
                              "worst-before", "worst-after"}, reached)
        self.focus("#worst-after li:last-child button")
        self.browser.key("Enter")
        self.browser.call("Input.dispatchKeyEvent", type="char", text="\r", key="Enter")
        self.browser.wait_for("document.querySelector('#worst-after li:last-child button')"
                              ".getAttribute('aria-current') === 'true'")

    def test_light_and_dark_are_readable_by_everybody(self):
        contrast = """(() => {
          const channel = c => (c /= 255) <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
          const luminance = rgb => 0.2126 * channel(rgb[0]) + 0.7152 * channel(rgb[1]) + 0.0722 * channel(rgb[2]);
          const numbers = text => text.match(/[\\d.]+/g).map(Number);
          const background = e => { for (; e; e = e.parentElement) { const c = numbers(getComputedStyle(e).backgroundColor);
            if (c.length < 4 || c[3] > 0) return c; } return [255, 255, 255]; };
          const ratio = e => { const style = getComputedStyle(e), a = luminance(numbers(e.ownerSVGElement ? style.fill : style.color)), b = luminance(background(e));
            return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05); };
          const scale = document.getElementById('scale');
          const pixels = scale.getContext('2d').getImageData(0, 5, scale.width, 1).data;
          const shades = Array.from({length: scale.width}, (_, i) => luminance(pixels.slice(4 * i, 4 * i + 3)));
          const least = ['p', '.note', '.before', '.after', 'th', 'td', 'button', '.what', '.term', 'small', 'svg text', 'summary']
            .map(s => [s, Math.min(...[...document.querySelectorAll(s)].map(ratio))]);
          return {least, shades, background: getComputedStyle(document.body).backgroundColor};
        })()"""
        backgrounds = set()
        for dark in (False, True):
            self.open(1366, 820, dark=dark)
            found = self.run_js(contrast)
            for selector, ratio in found["least"]:
                self.assertGreaterEqual(ratio, 4.5, f"{selector}, dark: {dark}")
            # Larger deviations stand out by lightness alone.
            shades = found["shades"] if dark else found["shades"][::-1]
            self.assertEqual(shades, sorted(shades))
            backgrounds.add(found["background"])
        self.assertEqual(len(backgrounds), 2)
        # The button changes the theme, too: auto, light, dark.
        self.open(1366, 820)
        first = self.picture()
        self.browser.click_on("#theme")
        self.browser.click_on("#theme")
        self.assertIn(self.run_js("getComputedStyle(document.body).backgroundColor"), backgrounds)
        self.assertNotEqual(self.picture(), first)

    def test_fits_a_phone(self):
        self.open(390, 844, phone=True)
        self.assertLessEqual(self.run_js("document.documentElement.scrollWidth"), 390)
        small = self.run_js("[...document.querySelectorAll('main button, #layer')].filter(e => e.offsetParent &&"
                            "!e.closest('.axes') && e.getBoundingClientRect().height < 32).map(e => e.id)")
        self.assertEqual(small, [])
        self.browser.click_on("#worst-before li:first-child button")
        self.browser.wait_for("document.getElementById('print').getBoundingClientRect().top < 40")

    def test_text_of_the_print_stays_text(self):
        name = HOSTILE.replace("/", "∕") + ".gcode"
        text = self.text.replace(";TYPE:", ";TYPE:" + HOSTILE) + f"\nM117 {HOSTILE}\n; {HOSTILE}\n"
        with tempfile.TemporaryDirectory() as folder:
            self.open(1366, 820, make_report(folder, name, text))
            self.assertEqual(self.run_js("document.title"), name)
            self.assertIn("pwned = 1</script>",
                          self.run_js("document.getElementById('features').textContent"))
            self.assertIsNone(self.run_js("window.pwned"))
            self.assertEqual(self.run_js("document.querySelectorAll('main img').length"), 0)

    def test_a_print_without_filament_is_no_error(self):
        with tempfile.TemporaryDirectory() as folder:
            self.open(1366, 820, make_report(folder, "empty.gcode", "G28\nG1 X10 Y10 F3000\n"))
            self.assertIn("No filament",
                          self.run_js("document.getElementById('layer-name').textContent"))


if __name__ == "__main__":
    if chromium.find() is None:
        print("skipped: there is no Chromium; apt-get install chromium")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
