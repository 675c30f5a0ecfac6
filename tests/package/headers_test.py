"""Every installed header on its own: headers_test.py BUILD CXX

Installs the headers from the build directory BUILD and has the compiler CXX read each of them alone.
"""

import concurrent.futures
import os
import subprocess
import sys
import tempfile
import unittest

BUILD, CXX = sys.argv[1:3]


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class Headers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        output("cmake", "--install", BUILD, "--prefix", scratch.name, "--component", "development")
        include = os.path.join(scratch.name, "include")
        cls.headers = sorted(os.path.relpath(os.path.join(folder, name), include)
                             for folder, _, names in os.walk(include) for name in names)
        cls.flags = [f"-I{include}", *output("pkg-config", "--cflags", "eigen3").split()]

    def complaints_about(self, header):
        return subprocess.run([CXX, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic",
                               *self.flags, "-x", "c++", "-"], capture_output=True, text=True,
                              input=f'#include "{header}"\n', check=False).stderr

    def test_every_installed_header_compiles_alone(self):
        self.assertIn("unflex/pipeline/pipeline.hpp", self.headers)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            complaints = pool.map(self.complaints_about, self.headers)
            self.assertEqual([text for text in complaints if text], [])

    def test_headers_of_the_program_itself_stay_behind(self):
        self.assertEqual([name for name in self.headers if name.startswith("unflex/app/")], [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
