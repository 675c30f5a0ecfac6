"""Prints on the tasks of a real Slurm on one machine: slurm_test.py UNFLEX SCRIPT [PRINTS]

UNFLEX is the program, SCRIPT examples/cluster/unflex.sbatch, PRINTS how many prints there are. Exit
code 77 where Slurm is missing, or where this user may not start it.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

UNFLEX, SCRIPT = (os.path.abspath(path) for path in sys.argv[1:3])
PRINTS = int(sys.argv[3]) if len(sys.argv) > 3 else 200
TASKS = 4
PRINTER = """schema_version = 1
[printer]
firmware = "klipper"
[dynamics.x]
freq_hz = 45
[dynamics.y]
freq_hz = 45
"""
CONFIGURATION = """ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmdPort={other_port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
CryptoType=crypto/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SchedulerParameters=batch_sched_delay=0,sched_interval=1,requeue_delay=1
SlurmdParameters=config_overrides
NodeName={host} NodeAddr=127.0.0.1 CPUs={tasks} RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Cluster:
    """Slurm's daemons on this machine, with all that they write in a folder."""

    def __init__(self, folder):
        self.folder = folder
        for part in ("state", "spool", "munge"):
            os.makedirs(os.path.join(folder, part), mode=0o700)
        munge = os.path.join(folder, "munge")
        with open(os.path.join(munge, "key"), "wb") as file:
            file.write(os.urandom(1024))
        os.chmod(os.path.join(munge, "key"), 0o600)
        subprocess.run(["munged", "--force"] + ["--{}={}/{}".format(option, munge, name) for option, name in (
            ("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"),
            ("seed-file", "seed"))], check=True, stderr=subprocess.DEVNULL)
        configuration = os.path.join(folder, "slurm.conf")
        with open(configuration, "w", encoding="utf-8") as file:
            file.write(CONFIGURATION.format(folder=folder, host=socket.gethostname().split(".")[0],
                                            port=free_port(), other_port=free_port(), tasks=TASKS))
        os.environ["SLURM_CONF"] = configuration
        subprocess.run(["slurmctld", "-i"], check=True)
        subprocess.run(["slurmd"], check=True)
        self.wait_for(lambda: "idle" in self.ask("sinfo", "--noheader"), "a node")

    def ask(self, *words):
        return subprocess.run(words, capture_output=True, text=True, check=False).stdout

    def wait_for(self, ready, what, seconds=300):
        end = time.monotonic() + seconds
        while not ready():
            if time.monotonic() > end:
                raise TimeoutError(what)
            time.sleep(0.2)

    def close(self):
        for pid in ("slurmd.pid", "slurmctld.pid", "munge/pid"):
            try:
                with open(os.path.join(self.folder, pid), encoding="utf-8") as file:
                    os.kill(int(file.read()), signal.SIGTERM)
            except (OSError, ValueError):
                pass
        time.sleep(1)


def sliced_print(number):
    lines = ["G28", "G90", "M83", "G1 X20 Y20 Z0.3 F6000"]
    for i in range(6):
        lines.append("G1 X{} Y{} E1 F3000".format(40 + number % 50 if i % 2 == 0 else 20, 20 + i))
    return "\n".join(["; print {}".format(number), *lines, ""])


def contents(folder):
    found = {}
    for place, _, names in os.walk(folder):
        for name in names:
            if not name.startswith(".unflex-batch"):
                with open(os.path.join(place, name), "rb") as file:
                    found[os.path.relpath(os.path.join(place, name), folder)] = file.read()
    return found


class Slurm(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        os.chdir(self.folder)
        for number in range(PRINTS):
            os.makedirs("in/{}".format(number % 7), exist_ok=True)
            with open("in/{}/{}.gcode".format(number % 7, number), "w", encoding="utf-8") as file:
                file.write(sliced_print(number))
        with open("printer.toml", "w", encoding="utf-8") as file:
            file.write(PRINTER)
        self.cluster = Cluster(os.path.join(self.folder, "cluster"))
        self.addCleanup(self.cluster.close)

    def done(self):
        return sum(name.endswith(".gcode") for _, _, names in os.walk("out") for name in names)

    def test_does_all_prints_once_though_a_task_is_killed(self):
        os.environ["UNFLEX"] = UNFLEX
        job = subprocess.run(["sbatch", "--parsable", "--mem-per-cpu=100M", SCRIPT, "in", "out",
                              "printer.toml"], check=True, capture_output=True, text=True).stdout.strip()
        self.cluster.wait_for(lambda: self.done() > PRINTS // 8, "some prints")
        # The node of the second task is lost: all of its processes are gone at once.
        task = job + "_2"
        killed = subprocess.run(["scancel", "--signal=KILL", "--full", task], check=False)
        self.assertEqual(killed.returncode, 0)
        self.cluster.wait_for(lambda: not self.cluster.ask("squeue", "--noheader"), "the end")
        lost = PRINTS - self.done()
        print("{} of {} prints were missing once the task was lost".format(lost, PRINTS))
        self.assertGreater(lost, 0)
        subprocess.run(["sbatch", "--wait",
                        "--mem-per-cpu=100M", "--wrap",
                        "{} batch in -o out --printer printer.toml --shard 2/{} -j 1 -q".format(
                            UNFLEX, TASKS)], check=True, stdout=subprocess.DEVNULL)
        self.assertEqual(self.done(), PRINTS)
        # One batch of all: finds all of it done, and has the same bytes.
        whole = subprocess.run([UNFLEX, "batch", "in", "-o", "out", "--printer", "printer.toml"],
                               check=True, capture_output=True, text=True).stdout
        self.assertIn("{} prints: 0 done, {} unchanged, 0 failed".format(PRINTS, PRINTS), whole)
        subprocess.run([UNFLEX, "batch", "in", "-o", "alone", "--printer", "printer.toml", "-q"],
                       check=True)
        self.assertEqual(contents("out"), contents("alone"))


if __name__ == "__main__":
    if os.geteuid() != 0 or not all(shutil.which(name) for name in ("slurmctld", "slurmd", "munged")):
        print("skipped: there is no Slurm, or no right to start it")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
