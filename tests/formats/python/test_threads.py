"""Any number of threads and processes read a dataset, and the result never depends on how many."""
import multiprocessing
import threading
import time
import unittest
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np

import cairn
from support import FOLDER, SurveyCase, build, survey_records, write_las


def digest(node):
    """What a process makes of a node that was sent to it."""
    points = node.read()
    return points.steps.astype(np.int64).sum(), int(points["color"].sum(dtype=np.int64))


class Threads(SurveyCase):
    def test_points_do_not_depend_on_the_number_of_threads(self):
        nodes = self.site.nodes[::-1]
        one = nodes.read(threads=1)
        for threads in (2, 5, None):
            many = nodes.read(threads=threads)
            np.testing.assert_array_equal(one.steps, many.steps)
            np.testing.assert_array_equal(one.weight, many.weight)
            for name, column in one.columns.items():
                np.testing.assert_array_equal(column, many[name])

    def test_threads_share_a_dataset(self):
        site = cairn.open(self.path)  # whose table and metadata no thread has asked for yet
        expected = {node.id: node.read().steps for node in self.site.nodes}
        with ThreadPoolExecutor(8) as pool:
            for id, steps in pool.map(lambda id: (id, site.node(id).read().steps), list(range(85)) * 4):
                np.testing.assert_array_equal(steps, expected[id])

    def test_processes_open_it_again(self):
        nodes = [self.site.node(id) for id in (0, 5, 84)]
        with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
            for found, node in zip(pool.map(digest, nodes), nodes):
                self.assertEqual(found, digest(node))

    def test_closing_while_others_read_lets_them_end(self):
        for _ in range(20):
            site = cairn.open(self.path)
            outcomes = []

            def read(site=site, outcomes=outcomes):
                try:
                    while True:
                        outcomes.append(len(site.level(-1).read(threads=1)))
                except cairn.UsageError as error:
                    outcomes.append(str(error))

            readers = [threading.Thread(target=read) for _ in range(3)]
            for reader in readers:
                reader.start()
            time.sleep(0.01)
            site.close()
            for reader in readers:
                reader.join(60)
                self.assertFalse(reader.is_alive())
            self.assertEqual(outcomes.count("the dataset is closed"), 3)
            self.assertTrue(all(outcome in (20_000, "the dataset is closed") for outcome in outcomes))

    def test_what_was_stopped_reads_nothing_more(self):
        reading = self.site._reader.reading([0, 1], [], False, False, False)
        self.assertEqual(len(reading.node(0)[0]), len(self.site.root.read()))
        reading.stop()
        for place in (0, 1):  # as a pool of threads does that has tasks left after Ctrl-C
            with self.assertRaises(KeyboardInterrupt):
                reading.node(place)

    def test_python_runs_while_a_node_is_decoded(self):
        write_las(FOLDER / "large.las", survey_records(300_000, seed=2))
        site = cairn.open(build("large", FOLDER / "large.las", "--node-points", "300000", "--codec", "lzo999"))
        root = site.root
        self.assertEqual(root.point_count, 300_000)
        ticks, done = 0, threading.Event()

        def read():
            for _ in range(5):
                root.read()
            done.set()

        reader = threading.Thread(target=read)
        reader.start()
        while not done.is_set():
            ticks += 1
            time.sleep(0)
        reader.join()
        # With the lock held through each read this thread would get a turn or two between reads: 8 were counted.
        self.assertGreater(ticks, 50)


if __name__ == "__main__":
    unittest.main()
