"""The scripts that pages and comments name, each on a small input: scripts_test.py BUILD UNFLEX ROOT

They build below BUILD/scripts, so that the second time little is left to do.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, UNFLEX, ROOT = sys.argv[1:4]
SUITE = "core_test"


def script(*words, **environment):
    builds = os.path.join(BUILD, "scripts")
    os.makedirs(builds, exist_ok=True)
    return subprocess.run([os.path.join(ROOT, words[0]), *words[1:]], capture_output=True, text=True,
                          env={**os.environ, "UNFLEX_BUILDS": builds, **environment})


class Scripts(unittest.TestCase):
    def works(self, done):
        self.assertEqual(done.returncode, 0, done.stdout[-3000:] + done.stderr[-3000:])
        return done.stdout

    def test_all_can_be_read(self):
        names = subprocess.run(["git", "-C", ROOT, "ls-files", "*.sh", ".ci/run"],
                               capture_output=True, text=True).stdout.split()
        for name in names:
            with self.subTest(name):
                self.works(subprocess.run(["bash", "-n", os.path.join(ROOT, name)],
                                          capture_output=True, text=True))

    @unittest.skipUnless(shutil.which("gcovr"), "there is no gcovr")
    def test_coverage_counts_the_lines_that_a_suite_reaches(self):
        said = self.works(script("tests/coverage.sh", "--only", SUITE))
        self.assertIn("src/core/number.cpp", said)
        self.assertIn("100% tests passed", said)

    @unittest.skipUnless(shutil.which("clang++-16"), "there is no clang")
    def test_a_suite_runs_under_sanitizers(self):
        for kind in ("address", "thread"):
            with self.subTest(kind):
                said = self.works(script("tests/sanitizers.sh", kind, "--only", SUITE))
                self.assertIn("100% tests passed, 0 tests failed out of 1", said)

    def test_the_benchmark_times_a_print_at_four_lengths(self):
        with tempfile.TemporaryDirectory() as folder:
            name = os.path.join(folder, "small.gcode")
            with open(name, "w", encoding="utf-8") as file:
                file.write("G28\nG90\nM83\nG1 X20 Y20 Z0.2 F6000\n")
                file.writelines(f"G1 X{20 + 20 * (i % 2)} Y{20 + i} E1 F3000\n" for i in range(10))
            said = self.works(script("tests/benchmark/whole_files.sh", UNFLEX, name, "--", "--set",
                                     "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45"))
            self.assertGreaterEqual(said.count("small"), 4)

    def test_presets_configure(self):
        for preset in ("release", "debug"):
            with self.subTest(preset):
                folder = os.path.join(BUILD, "scripts", preset)
                self.works(subprocess.run(
                    ["cmake", "--preset", preset, "-S", ROOT, "-B", folder, "-DUNFLEX_TESTS=OFF"],
                    capture_output=True, text=True, cwd=ROOT))


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
