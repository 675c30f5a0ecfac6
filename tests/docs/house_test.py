#!/usr/bin/env python3
"""house_test.py ROOT

What the code has promised of itself: firmwares are compared in one folder, and few headers are public.
"""

import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop(1))
COMPARED = re.compile(r"[!=]=\s*Firmware::\w|Firmware::\w+\s*[!=]=|case Firmware::")


def code(*folders):
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.[ch]pp")):
            yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")


class House(unittest.TestCase):
    def test_firmwares_are_compared_in_their_folder(self):
        places = [f"{name}:{number}" for name, text in code("src", "include")
                  if not name.startswith("src/firmware/")
                  for number, line in enumerate(text.splitlines(), 1) if COMPARED.search(line)]
        self.assertEqual(places, [], "ask for a trait of FirmwareSpec")

    def test_firmwares_have_the_same_tables(self):
        folders = [path for path in (ROOT / "src/firmware").iterdir() if path.is_dir()]
        self.assertGreaterEqual(len(folders), 3)
        for folder in folders:
            for name in ("spec.cpp", "reader.cpp", "planner.cpp", "dialect.cpp"):
                self.assertTrue((folder / name).is_file(), f"{folder}/{name}")

    def test_few_headers_are_public(self):
        self.assertLessEqual(len(list(code("include"))), 22)


if __name__ == "__main__":
    unittest.main()
