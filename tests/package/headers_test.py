"""Every installed header on its own: headers_test.py BUILD CXX SOURCES

Installs the headers from the build directory BUILD and has the compiler CXX read each of them
alone, but for those that a file of SOURCES includes before all others: the build has compiled them alone.
"""

import concurrent.futures
import os
import re
import subprocess
import sys
import tempfile
import unittest

BUILD, CXX, SOURCES = sys.argv[1:4]


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def files_below(folder):
    return sorted(os.path.join(where, name) for where, _, names in os.walk(folder)
                  for name in names)


def first_includes(folder):
    """What the sources in a folder include before all else."""
    found = set()
    for name in files_below(folder):
        if name.endswith(".cpp"):
            with open(name, encoding="utf-8") as file:
                first = re.search(r'^#include "?([^"\n]*)', file.read(), re.MULTILINE)
            found.add(first.group(1) if first else None)
    return found


class Headers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        output("cmake", "--install", BUILD, "--prefix", scratch.name, "--component", "development")
        include = os.path.join(scratch.name, "include")
        cls.headers = [os.path.relpath(name, include) for name in files_below(include)]
        cls.flags = [f"-I{include}", *output("pkg-config", "--cflags", "eigen3").split()]

    def complaints_about(self, header):
        return subprocess.run([CXX, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic",
                               *self.flags, "-x", "c++", "-"], capture_output=True, text=True,
                              input=f'#include "{header}"\n', check=False).stderr

    def test_every_installed_header_compiles_alone(self):
        self.assertIn("unflex/pipeline/pipeline.hpp", self.headers)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            left = sorted(set(self.headers) - first_includes(SOURCES))
            self.assertGreater(len(left), 0)
            self.assertEqual([text for text in pool.map(self.complaints_about, left) if text], [])

    def test_headers_of_the_program_itself_stay_behind(self):
        self.assertEqual([name for name in self.headers if name.startswith("unflex/app/")], [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
