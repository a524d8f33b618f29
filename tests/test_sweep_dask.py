#!/usr/bin/python3
"""bristle.sweep on a Dask cluster: a real scheduler, worker processes on loopback, one of them killed in the middle.

Exit code 77, which CTest shows as skipped, where Debian's python3-distributed is missing.

Needs the built module. For example: PYTHONPATH=build/release/python python3 tests/test_sweep_dask.py
"""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

if "--help" in sys.argv[1:]:
    sys.exit(print(__doc__.strip()))

import bristle

try:
    from distributed import Client, LocalCluster
except ImportError:
    print("skipped: no module distributed (on Debian: apt install python3-distributed)")
    sys.exit(77)

SCENE = """
[scene]
name = "slide"
dt = 1e-3
duration = 0.2
[[material]]
name = "wood"
presliding_length = 1e-5
[[patch]]
name = "tip"
material = "wood"
max_normal_load = 1.0
bristles = 60000
axes = 1
[[motion]]
patch = "tip"
type = "trace"
file = "motion.csv"
"""
MOTION = "t,x,load\n0,0,0.8\n0.2,2e-4,0.9\n"
VARY = {"material.wood.kinetic": "0.3:0.45:12", "patch.tip.axes": [1, 2]}
REPORT = ["kinetic", "state_hash"]


class OnDask(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.scene = pathlib.Path(cls.folder.name) / "slide.toml"
        cls.scene.write_text(SCENE)
        (cls.scene.parent / "motion.csv").write_text(MOTION)
        cls.cluster = LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None)
        cls.client = Client(cls.cluster)
        cls.workers = [cls.start_worker() for _ in range(2)]
        cls.client.wait_for_workers(2, timeout=60)
        cls.by_threads = bristle.sweep(cls.scene, VARY, report=REPORT, threads=2)

    @classmethod
    def tearDownClass(cls):
        for worker in cls.workers:
            worker.kill()
            worker.wait()
        cls.client.close()
        cls.cluster.close()
        cls.folder.cleanup()

    @classmethod
    def start_worker(cls):
        """Starts a worker as a process, without a nanny that would replace it, and in another folder."""
        environment = dict(os.environ, PYTHONPATH=str(pathlib.Path(bristle.__file__).parents[1]))
        return subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", cls.cluster.scheduler_address, "--no-nanny", "--nthreads",
             "1", "--no-dashboard"], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd="/tmp")

    def test_rows_are_those_of_threads_though_a_worker_is_killed_and_another_comes(self):
        out = self.scene.parent / "table.csv"
        rows = self.scene.parent / "table.csv.part"  # two lines of head, then a line a row
        killed_after = []

        def kill_one():
            while not rows.exists() or rows.read_bytes().count(b"\n") < 7:
                time.sleep(0.002)
            self.workers[0].send_signal(signal.SIGKILL)
            killed_after.append(rows.read_bytes().count(b"\n") - 2)
            self.workers.append(self.start_worker())

        killer = threading.Thread(target=kill_one, daemon=True)
        killer.start()
        table = bristle.sweep(self.scene, VARY, report=REPORT, out=out, client=self.client)
        killer.join(10)
        self.assertEqual(len(table), 24)
        self.assertLess(killed_after[0], 24)  # the worker was killed before all rows were done
        self.assertEqual(self.workers[0].wait(10), -signal.SIGKILL)
        self.assertEqual(table.hash, self.by_threads.hash)
        self.assertEqual(len(set(table["state_hash"])), 24)
        self.assertEqual(list(table["tip.kinetic"]), list(self.by_threads["tip.kinetic"]))
        self.assertEqual(out.read_bytes().count(b"\n"), 25)  # has every row once, though some ran twice

    def test_a_row_that_the_scene_refuses_is_the_same_row_on_a_worker(self):
        vary = {"material.wood.peak": [0.46, 3.0, -1.0]}
        here = bristle.sweep(self.scene, vary, report=REPORT)
        there = bristle.sweep(self.scene, vary, report=REPORT, client=self.client)
        self.assertEqual(here.hash, there.hash)
        self.assertIn("peak", there["failure"][2])
        self.assertNotIn(str(self.scene.parent), there["failure"][2])


if __name__ == "__main__":
    unittest.main()
