"""The examples for continuous integration: ci_test.py UNFLEX EXAMPLES

UNFLEX is the program, EXAMPLES the folder with the files. They are read as YAML, and the command
they give is run as it stands on a folder with a print. Exits with 77, which skips the test, where
Python has no YAML.
"""

import os
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

try:
    import yaml
except ImportError:
    yaml = None

UNFLEX, EXAMPLES = (os.path.abspath(path) for path in sys.argv[1:3])

PRINT = "G28\nG90\nM83\nG1 X20 Y20 F6000\nG1 X40 Y20 E0.8 F3000\nG1 X40 Y40 E0.8\nG1 X20 Y40 E0.8\n"


def load(name):
    with open(os.path.join(EXAMPLES, name), encoding="utf-8") as file:
        return yaml.safe_load(file)


def commands(job):
    """All lines of shell in a GitHub or a GitLab job."""
    if "script" in job:
        return job["before_script"] + job["script"]
    return [step["run"] for step in job["steps"] if "run" in step]


def run(command, maximum):
    """Exit code and JUnit cases of the command that calls `unflex batch`."""
    with tempfile.TemporaryDirectory() as folder:
        os.makedirs(os.path.join(folder, "prints"))
        os.makedirs(os.path.join(folder, ".unflex", "build"))
        os.symlink(UNFLEX, os.path.join(folder, ".unflex", "build", "unflex"))
        with open(os.path.join(folder, "prints", "a.gcode"), "w", encoding="utf-8") as file:
            file.write(PRINT)
        with open(os.path.join(folder, "printer.toml"), "w", encoding="utf-8") as file:
            file.write("[limits]\nmax_accel_mm_s2 = 3000\n[printer]\nfirmware = \"klipper\"\n"
                       "[dynamics.x]\nfreq_hz = 45\n[dynamics.y]\nfreq_hz = 45\n")
        done = subprocess.run(["bash", "-ec", command], cwd=folder, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, check=False,
                              env=dict(os.environ, MAX_DEVIATION_MM=maximum))
        tree = xml.etree.ElementTree.parse(os.path.join(folder, "summary.xml"))
        return done.returncode, tree.getroot()


class Examples(unittest.TestCase):
    def check(self, job):
        [batch] = [command for command in commands(job) if " batch " in command]
        for command in commands(job):
            subprocess.run(["bash", "-nc", command], check=True)
        code, suites = run(batch, "1")
        self.assertEqual(code, 0)
        self.assertEqual([case.get("name") for case in suites.iter("testcase")], ["a.gcode"])
        self.assertEqual(suites.get("failures"), "0")
        code, suites = run(batch, "0.000001")
        self.assertEqual(code, 3)
        self.assertEqual(suites.get("failures"), "1")
        self.assertIn("--max-deviation", suites.find("testsuite/testcase/failure").get("message"))

    def test_workflow_of_github_runs(self):
        workflow = load("github-actions.yml")
        # YAML 1.1 takes "on" for a truth value.
        self.assertEqual(set(workflow), {"name", True, "permissions", "env", "jobs"})
        job = workflow["jobs"]["deviation"]
        self.assertIn("MAX_DEVIATION_MM", workflow["env"])
        for step in job["steps"]:
            self.assertTrue(("run" in step) != ("uses" in step), step)
        self.check(job)

    def test_job_of_gitlab_runs(self):
        [job] = load("gitlab-ci.yml").values()
        self.assertIn("MAX_DEVIATION_MM", job["variables"])
        self.assertEqual(job["artifacts"]["reports"]["junit"], "summary.xml")
        self.check(job)


if __name__ == "__main__":
    if yaml is None:
        print("skipped: Python has no YAML")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
