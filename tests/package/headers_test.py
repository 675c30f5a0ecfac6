"""Every installed header on its own: headers_test.py BUILD CXX ROOT

Each header that is installed from the build directory BUILD must compile alone. A source that
includes a header before all others has compiled it so, but for the headers that the build compiles
beforehand (cmake/PrecompiledHeaders.cmake): what of those a header uses, it must include. The compiler
CXX reads all other headers alone, through ccache where that is installed.
"""

import concurrent.futures
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, CXX, ROOT = sys.argv[1:4]


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def files_below(folder):
    return sorted(os.path.join(where, name) for where, _, names in os.walk(folder)
                  for name in names)


def read(name):
    with open(name, encoding="utf-8") as file:
        return file.read()


def first_includes():
    """What the sources include before all else."""
    found = set()
    for name in files_below(os.path.join(ROOT, "src")):
        if name.endswith(".cpp"):
            first = re.search(r'^#include "([^"\n]*)', read(name), re.MULTILINE)
            found.add(first.group(1) if first else None)
    return found


# What a header may use of the headers that are compiled beforehand, and where that is from.
HIDDEN = {r"std::(sort|min|max|clamp|any_of|ranges::)": "algorithm", r"std::array<": "array",
          r"std::(sqrt|hypot|abs|pow|exp|isnan|isfinite|llround|lround)\(": "cmath",
          r"std::(unique_ptr|shared_ptr|make_unique|make_shared|weak_ptr)\b": "memory",
          r"std::(optional<|nullopt)": "optional", r"std::string\b": "string",
          r"std::string_view\b": "string_view", r"std::(move|pair<|exchange|forward)": "utility",
          r"std::vector<": "vector", r"fmt::": "fmt/core.h", r"tl::(expected|unexpected)": "tl/expected.hpp"}
# Headers that bring another one along, by the standard.
BRINGS = {"string": {"string_view"}, "map": {"utility"}, "unordered_map": {"utility"},
          "tl/expected.hpp": {"utility"}}


def included(header):
    """All headers that one brings, through those of unflex."""
    found = set()
    waiting = [header]
    while waiting:
        for name in re.findall(r'^#include [<"]([^>"]+)', read(f"{ROOT}/include/{waiting.pop()}"),
                               re.MULTILINE):
            if name not in found:
                found.add(name)
                found |= BRINGS.get(name, set())
                if name.startswith("unflex/"):
                    waiting.append(name)
    return found


class Headers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        output("cmake", "--install", BUILD, "--prefix", scratch.name, "--component", "development")
        include = os.path.join(scratch.name, "include")
        cls.headers = [os.path.relpath(name, include) for name in files_below(include)]
        cls.flags = output("pkg-config", "--cflags", "eigen3").split()

    def complaints_about(self, header):
        """What the compiler says of a source that includes nothing but the header."""
        name = os.path.join(BUILD, "headers", header.replace("/", "_"))
        with open(name + ".cpp", "w", encoding="utf-8") as source:
            source.write(f'#include "{header}"\n')
        ccache = [shutil.which("ccache")] if shutil.which("ccache") else []
        return subprocess.run([*ccache, CXX, "-std=c++20", "-Wall", "-Wextra", "-Wpedantic",
                               f"-I{ROOT}/include", *self.flags, "-c", name + ".cpp", "-o",
                               name + ".o"], capture_output=True, text=True, check=False,
                              env={**os.environ, "CCACHE_BASEDIR": ROOT}).stderr

    def test_every_installed_header_compiles_alone(self):
        self.assertIn("unflex/flow/flow.hpp", self.headers)
        compiled = first_includes()
        self.assertIn("unflex/emit/emitter.hpp", compiled)
        os.makedirs(os.path.join(BUILD, "headers"), exist_ok=True)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            left = sorted(set(self.headers) - compiled)
            self.assertGreater(len(left), 0)
            self.assertEqual([text for text in pool.map(self.complaints_about, left) if text], [])

    def test_every_header_includes_what_the_build_compiles_beforehand(self):
        with_std = read(f"{ROOT}/cmake/PrecompiledHeaders.cmake")
        for name in set(HIDDEN.values()):
            self.assertIn(f"<{name}>", with_std)
        for header in self.headers:
            code = re.sub(r"//.*", "", read(f"{ROOT}/include/{header}"))
            brought = included(header)
            for used, source in HIDDEN.items():
                with self.subTest(header=header, source=source):
                    self.assertTrue(source in brought or not re.search(used, code),
                                    f"{header} uses <{source}> without including it")

    def test_there_are_few_of_them(self):
        self.assertLessEqual(len(self.headers), 22)
        self.assertIn("unflex/unflex.hpp", self.headers)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
