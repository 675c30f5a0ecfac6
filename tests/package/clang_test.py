"""A second compiler reads the sources: clang_test.py ROOT

clang builds what the sanitizers and the fuzzing programs need (tests/sanitizers.sh,
tests/fuzz/run.sh), and refuses or warns of what GCC takes. Here it reads the public headers, and
those sources that the last commits or the working tree have changed.
"""

import concurrent.futures
import glob
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = sys.argv[1]

# What changed further back has been read before.
COMMITS = 5
# A change of more files than that is alike in many of them, so only some of these are read.
MOST = 30
# Sources for other systems, which this compiler cannot read.
ELSEWHERE = ("src/platform/windows/", "src/platform/wasi/", "src/web/")
OPTIONS = ["-std=c++20", "-DFMT_SHARED", '-DUNFLEX_VERSION=""', "-DTOML_HEADER_ONLY=1",
           "-DTOML_EXCEPTIONS=0", f"-I{ROOT}/include", f"-I{ROOT}/tests", f"-I{ROOT}/tests/text",
           # Files in src/firmware belong to these modules.
           *(f"-I{ROOT}/src/{name}" for name in ("flow", "gcode", "planner", "emit", "machine", "firmware")),
           *(f"-I{folder}" for folder in sorted(glob.glob(f"{ROOT}/src/*/include"))),
           "-isystem", "/usr/include/eigen3", "-isystem", "/usr/include/coin",
           "-Wall", "-Wextra", "-Werror", "-Wno-missing-braces"]
# Headers that take long, read once for all sources.
OF_OTHERS = ["CLI/CLI.hpp", "Eigen/Dense", "fmt/format.h", "nlohmann/json.hpp"]


def find_clang():
    return shutil.which("clang++-16") or shutil.which("clang++")


def git(*arguments):
    found = subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, text=True)
    return found.stdout.splitlines() if found.returncode == 0 else []


def changed_sources():
    """Paths below ROOT; none in a copy without its history."""
    names = set(git("diff", "--name-only", f"HEAD~{COMMITS}"))
    names.update(git("ls-files", "--others", "--exclude-standard"))
    sources = sorted(name for name in names
                     if name.startswith(("src/", "tests/fuzz/")) and name.endswith(".cpp")
                     and not name.startswith(ELSEWHERE)
                     and os.path.exists(os.path.join(ROOT, name)))
    return sources[::1 + len(sources) // MOST]


def public_headers():
    """Those for users of the library, and those that modules have for each other."""
    tops = [os.path.join(ROOT, "include"), *glob.glob(os.path.join(ROOT, "src", "*", "include"))]
    return sorted(os.path.join(where, name) for top in tops
                  for where, _, names in os.walk(top) for name in names)


class Sources(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.clang = find_clang()
        if cls.clang is None:
            sys.exit(77)
        cls.folder = tempfile.TemporaryDirectory()
        header = os.path.join(cls.folder.name, "all.hpp")
        with open(header, "w", encoding="utf-8") as file:
            file.writelines(f"#include <{name}>\n" for name in OF_OTHERS)
            file.writelines(f'#include "{name}"\n' for name in public_headers())
        cls.compiled = os.path.join(cls.folder.name, "all.pch")
        cls.of_headers = cls.complaints("-fpch-instantiate-templates", "-x", "c++-header", header,
                                        "-o", cls.compiled)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def complaints(cls, *words):
        read = subprocess.run([cls.clang, *OPTIONS, *words], capture_output=True, text=True)
        return read.stderr

    def test_public_headers_are_read(self):
        self.assertEqual(self.of_headers, "")

    def test_sources_that_changed_are_read(self):
        def read(name):
            return self.complaints("-fsyntax-only", "-fpch-instantiate-templates", "-include-pch",
                                   self.compiled, os.path.join(ROOT, name))

        names = changed_sources()
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            for name, said in zip(names, pool.map(read, names)):
                with self.subTest(name):
                    self.assertEqual(said, "")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
