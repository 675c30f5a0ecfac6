#!/usr/bin/env python3
"""comments_test.py ROOT

No comment leans on the line before it for its subject, and every source is formatted.
"""

import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop(1))
COMMENT = {".cpp": "//+", ".hpp": "//+", ".js": "//+", ".css": r"/\*+", ".py": "#+", ".sh": "#+",
           ".cmake": "#+", ".txt": "#+", ".cfg": "#+"}
FOLDERS = ["src", "include", "tests", "cmake", "examples", "share"]
WITHOUT_SUBJECT = r" *(Of|The same|…|\.\.\.)(?![\w])"


def sources(*endings):
    return [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*"))
            if path.suffix in endings and path.is_file() and "data" not in path.parts
            and "corpus" not in path.parts]


class Comments(unittest.TestCase):
    def test_begin_with_their_subject(self):
        for path in sources(*COMMENT):
            begins = re.compile(rf"(?:^|\s){COMMENT[path.suffix]}{WITHOUT_SUBJECT}")
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                with self.subTest(place=f"{path.relative_to(ROOT)}:{number}"):
                    self.assertNotRegex(line, begins)


class Format(unittest.TestCase):
    def test_is_that_of_clang_format(self):
        # Debian's clang-format 14; another version formats some lines otherwise.
        version = subprocess.run(["clang-format", "--version"], capture_output=True, text=True,
                                 check=True).stdout
        if "version 14." not in version:
            self.skipTest(version)
        files = sources(".cpp", ".hpp")
        half = len(files) // 2
        checks = [subprocess.Popen(["clang-format", "--dry-run", "--Werror", *part],
                                   stderr=subprocess.PIPE, text=True)
                  for part in (files[:half], files[half:])]
        for check in checks:
            self.assertEqual(check.communicate()[1], "")
            self.assertEqual(check.returncode, 0)


if __name__ == "__main__":
    unittest.main()
