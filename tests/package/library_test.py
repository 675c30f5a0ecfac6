"""The library as other projects use it: library_test.py BUILD UNFLEX CXX DATA EXAMPLES

Installs from the build directory BUILD into a temporary folder, builds EXAMPLES/library there with
the compiler CXX, and compares its output for a print of DATA with that of the program UNFLEX.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, UNFLEX, CXX, DATA, EXAMPLES = sys.argv[1:6]


def run(*command, **more):
    return subprocess.run(command, capture_output=True, text=True, check=False, **more)


class Library(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.folder = scratch.name
        # Install into one folder and move the result to another, because users may move an
        # installation.
        first = os.path.join(cls.folder, "first")
        cls.prefix = os.path.join(cls.folder, "prefix")
        subprocess.run(["cmake", "--install", BUILD, "--prefix", first], check=True,
                       stdout=subprocess.DEVNULL)
        os.rename(first, cls.prefix)

    def configure(self, name, *options):
        source = shutil.copytree(os.path.join(EXAMPLES, "library"),
                                 os.path.join(self.folder, name))
        build = os.path.join(source, "build")
        return build, run("cmake", "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}",
                          f"-DCMAKE_CXX_COMPILER={CXX}", *options)

    def test_the_example_writes_what_the_program_writes(self):
        """The commands are those of docs/library.md, in a folder of their own."""
        root = os.path.dirname(EXAMPLES)
        with open(os.path.join(root, "docs", "library.md"), encoding="utf-8") as page:
            outside_blocks = re.sub(r"```[\s\S]*?```", "", page.read())
        commands = [line.split() for line in outside_blocks.splitlines() if line.startswith("    ")]
        self.assertEqual(len(commands), 4)
        commands[0][2] = BUILD
        for words in commands:
            words[:] = [word.replace("/tmp/", self.folder + "/page/") for word in words]
        commands[1].append(f"-DCMAKE_CXX_COMPILER={CXX}")
        source = os.path.join(DATA, "pipeline_washer_arcs.gcode")
        printer = os.path.join(EXAMPLES, "printer.toml")
        ours, theirs = (os.path.join(self.folder, name) for name in ("ours.gcode", "theirs.gcode"))
        commands[3][1:] = [source, theirs, printer]  # a shorter print, and nothing in the sources
        for words in commands:
            done = run(*words, cwd=root)
            self.assertEqual(done.returncode, 0, " ".join(words) + "\n" + done.stdout + done.stderr)
        program = run(UNFLEX, "compensate", source, "-o", ours, "--printer", printer)
        self.assertEqual(program.returncode, 0, program.stderr)
        self.assertGreater(os.path.getsize(ours), os.path.getsize(source))
        with open(ours, "rb") as first, open(theirs, "rb") as second:
            self.assertEqual(first.read(), second.read())

    def test_the_example_of_the_page_compiles_and_runs(self):
        with open(os.path.join(os.path.dirname(EXAMPLES), "docs", "library.md"),
                  encoding="utf-8") as page:
            example = re.search(r"```cpp\n(.*?)```", page.read(), re.DOTALL).group(1)
        source = os.path.join(self.folder, "page_example")
        os.mkdir(source)
        with open(os.path.join(source, "main.cpp"), "w", encoding="utf-8") as file:
            file.write(example)
        with open(os.path.join(source, "CMakeLists.txt"), "w", encoding="utf-8") as file:
            file.write("cmake_minimum_required(VERSION 3.25)\nproject(page_example LANGUAGES CXX)\n"
                       "find_package(unflex 0.1 CONFIG REQUIRED)\n"
                       "add_executable(page_example main.cpp)\n"
                       "target_link_libraries(page_example PRIVATE unflex::unflex)\n")
        build = os.path.join(source, "build")
        for words in (("cmake", "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={self.prefix}",
                       f"-DCMAKE_CXX_COMPILER={CXX}"), ("cmake", "--build", build)):
            done = run(*words)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        print_file = os.path.join(DATA, "pipeline_washer_arcs.gcode")
        written = os.path.join(source, "out.gcode")
        done = run(os.path.join(build, "page_example"), print_file, written)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertGreater(os.path.getsize(written), os.path.getsize(print_file))

    def test_the_installed_program_runs(self):
        here = run(UNFLEX, "--version")
        there = run(os.path.join(self.prefix, "bin", "unflex"), "--version")
        self.assertEqual((there.returncode, there.stdout), (0, here.stdout))

    def test_what_is_missing_is_named_with_its_package(self):
        _, configured = self.configure("without_fmt", "-DCMAKE_DISABLE_FIND_PACKAGE_fmt=ON")
        self.assertNotEqual(configured.returncode, 0)
        self.assertIn("fmt (in Debian libfmt-dev)", " ".join(configured.stderr.split()))

    def test_a_version_that_may_differ_is_refused(self):
        source = os.path.join(self.folder, "newer")
        os.mkdir(source)
        with open(os.path.join(source, "CMakeLists.txt"), "w", encoding="utf-8") as file:
            file.write("cmake_minimum_required(VERSION 3.25)\nproject(newer LANGUAGES CXX)\n"
                       "find_package(unflex 99.0 CONFIG REQUIRED)\n")
        configured = run("cmake", "-S", source, "-B", os.path.join(source, "build"),
                         f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DCMAKE_CXX_COMPILER={CXX}")
        self.assertNotEqual(configured.returncode, 0)
        self.assertIn("requested version", configured.stderr)

    def test_manual_examples_and_completions_are_where_they_are_looked_for(self):
        for name in ("man/man1/unflex.1.gz", "doc/unflex/docs/cli.md",
                     "doc/unflex/examples/washer.gcode",
                     "bash-completion/completions/unflex", "zsh/site-functions/_unflex",
                     "fish/vendor_completions.d/unflex.fish"):
            self.assertTrue(os.path.isfile(os.path.join(self.prefix, "share", name)), name)

    def test_nothing_installed_names_the_build_directory(self):
        for folder, _, names in os.walk(os.path.join(self.prefix, "lib", "cmake")):
            for name in names:
                with open(os.path.join(folder, name), encoding="utf-8") as file:
                    text = file.read()
                self.assertNotIn(BUILD, text, name)
                self.assertNotIn(os.path.dirname(EXAMPLES), text, name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
