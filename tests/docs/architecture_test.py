#!/usr/bin/env python3
"""architecture_test.py ROOT MODULES

Holds docs/architecture.md, docs/words.md and CONTRIBUTING.md against the code: every file, function
and type that they name exists, the table of modules tells what sources include, and the picture of
modules has the arrows of the build.
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(sys.argv.pop(1))
MODULES = pathlib.Path(sys.argv.pop(1))

sys.path.insert(0, str(ROOT / "docs"))
import draw_modules  # noqa: E402

PAGES = ["docs/architecture.md", "docs/words.md", "CONTRIBUTING.md"]
FOLDERS = ["src", "include", "tests", "cmake", "docs", "examples", "share", ".ci"]
ENDINGS = (".cpp", ".hpp", ".md", ".py", ".sh", ".cmake", ".txt", ".toml", ".gcode", ".svg", ".cfg")


def files():
    found = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.is_file()]
    found += [path for path in ROOT.iterdir() if path.is_file()]
    return [path.relative_to(ROOT).as_posix() for path in found]


FILES = files()
CODE = {name: (ROOT / name).read_text(encoding="utf-8") for name in FILES
        if name.startswith(("src/", "include/", "tests/")) and name.endswith((".cpp", ".hpp"))}
PRODUCT = "\n".join(text for name, text in CODE.items() if not name.startswith("tests/"))


def occurs(pattern):
    return re.search(rf"\b{pattern}", PRODUCT) is not None


def page(name):
    return (ROOT / name).read_text(encoding="utf-8")


def marked(text):
    """What stands between backticks, without the blocks of code."""
    return re.findall(r"`([^`\n]+)`", re.sub(r"(?m)^(    .*|```[\s\S]*?```)$", "", text))


def matches(name):
    """The files that a page means by a name or by the end of a path."""
    name = name.rstrip("/")
    if re.search(r"[*<]", name):
        pattern = re.escape(name).replace(r"\*", "[^/]*")
        pattern = re.sub("<[a-z]+>", "[^/]+", pattern)
        return [file for file in FILES if re.search(f"(^|/){pattern}(/|$)", file)]
    return [file for file in FILES
            if file == name or file.endswith("/" + name) or file.startswith(name + "/")]


def arrows(svg):
    """The arrows of a picture, as pairs of modules."""
    titles = re.findall(r"<title>(.*?)</title>", svg.replace("&#45;", "-"))
    return {tuple(title.split("-&gt;")) for title in titles if "-&gt;" in title}


class Names(unittest.TestCase):
    def test_every_file_exists(self):
        for name in PAGES:
            for word in marked(page(name)):
                if re.fullmatch(r"[\w./*<>-]+", word) and (word.endswith(ENDINGS) or
                                                         re.match(r"(src|include|tests|docs)/", word)):
                    with self.subTest(page=name, file=word):
                        self.assertTrue(matches(word), f"{name} names {word}, which is not there")

    def test_every_function_exists(self):
        for name in PAGES:
            for word in marked(page(name)):
                function = re.fullmatch(r"((?:\w+::)*)(~?\w+)\(.*\)", word)
                if function and not word.startswith(("find_package(", "include(")):
                    with self.subTest(page=name, function=word):
                        self.assertTrue(occurs(rf"{function[2]}\s*\("))
                        for qualifier in function[1].split("::")[:-1]:
                            self.assertTrue(occurs(rf"{qualifier}\b"))

    def test_every_function_is_in_the_file_behind_it(self):
        for name in PAGES:
            for function, file in re.findall(r"`(?:\w+::)*(\w+)\(\)`\s+\(`([\w./]+\.[ch]pp)`",
                                             page(name)):
                with self.subTest(page=name, function=function, file=file):
                    self.assertTrue(any(re.search(rf"\b{function}\s*\(", CODE[found])
                                        for found in matches(file) if found in CODE))

    def test_every_type_exists(self):
        for name in PAGES:
            for word in marked(page(name)):
                if re.fullmatch(r"(?:[a-z_]+::)*[A-Z][a-z]\w*[A-Za-z](?:::\w+)?", word):
                    with self.subTest(page=name, type=word):
                        for part in word.split("::"):
                            self.assertTrue(occurs(rf"{part}\b"))


class Modules(unittest.TestCase):
    def test_the_table_tells_what_sources_include(self):
        links = draw_modules.read(MODULES)
        layers = draw_modules.layers(links)
        rows = re.findall(r"(?m)^\| (\d+) \| `(\w+)` \| .* \| ([\w, ]*)\|$",
                          page("docs/architecture.md"))
        self.assertEqual({module for _, module, _ in rows}, set(links))
        for layer, module, uses in rows:
            with self.subTest(module=module):
                included = set()
                for file, text in CODE.items():
                    if file.startswith((f"src/{module}/", f"include/unflex/{module}/")):
                        included.update(re.findall(r'#include "unflex/(\w+)/', text))
                self.assertEqual(set(uses.replace(",", " ").split()), included - {module})
                self.assertEqual(int(layer), layers[module])

    def test_the_picture_has_the_arrows_of_the_build(self):
        self.assertEqual(arrows(page("docs/modules.svg")),
                         draw_modules.reduced(draw_modules.read(MODULES)),
                         "run docs/draw_modules.py build/modules.txt")

    def test_the_picture_is_what_the_script_draws(self):
        if not shutil.which("dot"):
            self.skipTest("there is no Graphviz")
        with tempfile.TemporaryDirectory() as folder:
            drawn = pathlib.Path(folder) / "modules.svg"
            subprocess.run([ROOT / "docs/draw_modules.py", MODULES, drawn], check=True)
            # Places depend on the fonts that are installed.
            self.assertEqual(arrows(drawn.read_text(encoding="utf-8")),
                             arrows(page("docs/modules.svg")))


if __name__ == "__main__":
    unittest.main()
