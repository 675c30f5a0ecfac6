"""The Debian packages: deb_test.py BUILD VERSION BUILD_TYPE

Makes the packages from the build directory BUILD and checks their contents; bare_root.sh installs
and runs them. Exits with 77, which skips the test, if this is not Debian.
"""

import glob
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, VERSION, BUILD_TYPE = sys.argv[1:4]
PROGRAM = [
    "/usr/bin/unflex",
    "/usr/share/bash-completion/completions/unflex",
    "/usr/share/doc/unflex/changelog.gz",
    "/usr/share/doc/unflex/README.md",
    "/usr/share/doc/unflex/copyright",
    "/usr/share/doc/unflex/docs/cli.md",
    "/usr/share/doc/unflex/examples/cura/UnflexCompensate.py",
    "/usr/share/doc/unflex/examples/printer.toml",
    "/usr/share/doc/unflex/examples/washer.gcode",
    "/usr/share/fish/vendor_completions.d/unflex.fish",
    "/usr/share/man/man1/unflex.1.gz",
    "/usr/share/zsh/vendor-completions/_unflex",
]
DEVELOPMENT = [
    "/usr/include/unflex/flow/flow.hpp",
    "/usr/lib/cmake/unflex/unflexConfig.cmake",
    "/usr/lib/libunflex_flow.a",
    "/usr/share/doc/libunflex-dev/copyright",
    "/usr/share/doc/unflex/examples/library/main.cpp",
]


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.folder = scratch.name
        subprocess.run(["cpack", "--config", os.path.join(BUILD, "CPackConfig.cmake"), "-B",
                        cls.folder], cwd=cls.folder, check=True, stdout=subprocess.DEVNULL)

    def package(self, name):
        found = glob.glob(os.path.join(self.folder, f"{name}_*.deb"))
        self.assertEqual(len(found), 1, found)
        return found[0]

    def names(self, package):
        """The names of the files in a package; also checks their owner and mode."""
        found = []
        for line in output("dpkg-deb", "--contents", self.package(package)).splitlines():
            mode, owner, _, _, _, name = line.split(maxsplit=5)
            self.assertEqual(owner, "root/root", line)
            executable = mode.startswith("d") or "/bin/" in name
            self.assertEqual(mode[1:], "rwxr-xr-x" if executable else "rw-r--r--", line)
            if not mode.startswith("d"):
                found.append(name[1:])
        return found

    def field(self, package, name):
        return output("dpkg-deb", "--field", self.package(package), name).strip()

    def test_the_program_comes_with_manual_examples_and_completions(self):
        names = self.names("unflex")
        self.assertEqual([name for name in PROGRAM if name not in names], [])
        self.assertEqual([name for name in names if name.startswith(("/usr/include", "/usr/lib"))],
                         [])

    def test_the_library_has_a_package_of_its_own(self):
        names = self.names("libunflex-dev")
        self.assertEqual([name for name in DEVELOPMENT if name not in names], [])
        self.assertEqual(set(names) & set(self.names("unflex")), set())

    def test_version_and_maintainer_are_named(self):
        for package in ("unflex", "libunflex-dev"):
            self.assertEqual(self.field(package, "Version"), VERSION)
            self.assertRegex(self.field(package, "Maintainer"), r"^[^<>]+ <[^<>@ ]+@[^<>@ ]+>$")

    def test_descriptions_begin_with_one_line_of_their_own(self):
        for package, summary in (("unflex", "G-code that takes the flex out of a 3D printer"),
                                 ("libunflex-dev", "library that takes the flex out of")):
            lines = self.field(package, "Description").splitlines()
            self.assertTrue(lines[0].startswith(summary), lines[0])
            self.assertGreater(len(lines), 3)
            self.assertEqual([line for line in lines[1:] if not re.match(r" \S", line)], [])

    def test_the_program_depends_on_the_libraries_it_links(self):
        depends = self.field("unflex", "Depends")
        for library in ("libc6", "libstdc\\+\\+6", "coinor-libipopt1v5", "libfmt9"):
            self.assertRegex(depends, rf"(^|, ){library}\b")

    def test_the_library_depends_on_what_the_build_needs(self):
        depends = set(self.field("libunflex-dev", "Depends").split(", "))
        script = os.path.join(os.path.dirname(__file__), "..", "..", "cmake", "install_packages.sh")
        with open(script, encoding="utf-8") as file:
            listed = re.search(r"^packages=\((.*?)^\)", file.read(), re.MULTILINE | re.DOTALL)
        needed = {word for line in listed.group(1).splitlines() if "#" not in line
                  for word in line.split()}
        # Leave out the tools for building, and what only the program needs.
        self.assertEqual(depends, needed - {"g++", "cmake", "ninja-build", "libcli11-dev"})

    def test_links_of_the_documentation_lead_somewhere(self):
        for package in ("unflex", "libunflex-dev"):
            output("dpkg-deb", "--extract", self.package(package), self.folder)
        there = os.path.join(self.folder, "usr/share/doc/unflex")
        links = 0
        for document in glob.glob(os.path.join(there, "**", "*.md"), recursive=True):
            with open(document, encoding="utf-8") as file:
                found = re.findall(r"\]\(([^)#]+)[^)]*\)", file.read())
            # Packages have the text of LICENSE in `copyright`.
            for link in found:
                if link != "LICENSE" and not link.startswith("https://"):
                    links += 1
                    self.assertTrue(os.path.exists(os.path.join(os.path.dirname(document), link)),
                                    f"{document}: {link}")
        self.assertGreater(links, 40)

    def test_the_terms_of_what_is_compiled_in_are_named(self):
        output("dpkg-deb", "--extract", self.package("unflex"), self.folder)
        with open(os.path.join(self.folder, "usr/share/doc/unflex/copyright"),
                  encoding="utf-8") as file:
            text = file.read()
        for words in ("MIT License", "unflex contributors", "src/report/assets", "libcli11-dev",
                      "libeigen3-dev", "nlohmann-json3-dev"):
            self.assertIn(words, text)

    def test_lintian_finds_no_errors_or_warnings(self):
        if not shutil.which("lintian"):
            self.skipTest("there is no lintian")
        if BUILD_TYPE != "Release":
            self.skipTest(f"a {BUILD_TYPE} build is not for packages")
        found = subprocess.run(["lintian", "--allow-root", "--fail-on", "error,warning",
                                self.package("unflex"), self.package("libunflex-dev")],
                               capture_output=True, text=True, check=False)
        self.assertEqual(found.stdout, "")
        self.assertEqual(found.returncode, 0, found.stderr)


if __name__ == "__main__":
    if not shutil.which("dpkg-shlibdeps"):
        print("skipped: there is no dpkg-shlibdeps")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1], verbosity=2)
