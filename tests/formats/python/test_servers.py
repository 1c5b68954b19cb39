"""Datasets on a server give what the same dataset gives on a disk; and nothing that waits for a server waits for ever."""
import multiprocessing
import os
import pickle
import signal
import subprocess
import threading
import time
import unittest
from unittest import mock

import numpy as np

import cairn
from support import FAULTS, FOLDER, PROGRAM, SurveyCase, WebServer, build, copy_of, python, write_las, survey_records


class ServedCase(SurveyCase):
    def setUp(self):
        self.server = WebServer(self)
        self.url = self.server.url(self.path)

    def open(self, **options):
        """The survey from the server, nothing of it kept unless asked for."""
        site = cairn.open(self.url, **{"web_cache": False, **options})
        self.addCleanup(site.close)
        return site

    def assert_same_points(self, found, expected):
        np.testing.assert_array_equal(found.steps, expected.steps)
        np.testing.assert_array_equal(found.weight, expected.weight)
        self.assertEqual(list(found.columns), list(expected.columns))
        for name, column in expected.columns.items():
            np.testing.assert_array_equal(found[name], column)


class Served(ServedCase):
    def test_all_is_as_on_a_disk(self):
        site = self.open()
        self.assertEqual((site.source, site.point_count, site.crs), (self.url, 20_000, self.site.crs))
        np.testing.assert_array_equal(site.nodes.table, self.site.nodes.table)
        for threads in (1, 3):
            self.assert_same_points(site.nodes.read(threads=threads), self.site.nodes.read())
        self.assert_same_points(site.root.read(["color"]), self.site.root.read(["color"]))
        self.assertEqual(site.root.blocks, self.site.root.blocks)
        low, high = self.site.bounds
        box = [low, (low + high) / 2]
        self.assert_same_points(site.read_box(box), self.site.read_box(box))
        points = site.level(1).read([], representative=True)
        np.testing.assert_array_equal(points.representative, self.site.level(1).read([], representative=True).representative)

    def test_what_is_not_there_is_an_access_error(self):
        error = self.refusal(lambda: cairn.open(self.server.url("missing.cairn"), web_cache=False), cairn.AccessError)
        self.assertIn("404", error)
        self.assertIn("/missing.cairn/index.bin", error)
        self.server.server_close()
        self.server.shutdown()
        self.refusal(self.open, cairn.AccessError)

    def test_an_address_that_can_be_none_is_refused(self):
        self.refusal(lambda: cairn.open("http://user@host/site.cairn"))

    def test_damaged_bytes_are_an_input_error_and_nothing_is_kept_of_them(self):
        def flip(body):
            body[len(body) // 2] ^= 1
            return body

        self.server.damage = flip
        for kept in (False, FOLDER / "kept-of-damaged"):
            site = self.open(web_cache=kept)
            for threads in (1, 3):
                error = self.refusal(lambda: site.level(2).read(threads=threads), cairn.InputError)
                self.assertIn(f"{self.url}/nodes.bin", error)
        self.server.damage = None
        self.assert_same_points(site.level(2).read(), self.site.level(2).read())

    def test_the_next_nodes_come_while_one_is_waited_for(self):
        self.server.delay_s = 0.2
        whole = {"representative": True}  # all sections, which lie side by side
        for read in (lambda site: site.level(3).read(threads=1, **whole),
                     lambda site: site.level(3)[::-1].read(threads=2, **whole),
                     lambda site: site.read_box(site.bounds, threads=1, **whole)):
            site = self.open()
            self.server.answered.clear()
            self.server.most_at_once = 0
            begin = time.monotonic()
            read(site)
            # 64 nodes of 6 KB each, one after the other, would take 12.8 seconds. A request joins at most 256 KiB.
            self.assertLess(time.monotonic() - begin, 6)
            self.assertLess(len(self.server.answered), 20)
            self.assertGreater(self.server.most_at_once, 1)

    def test_nothing_is_fetched_twice(self):
        site = self.open()
        self.server.answered.clear()
        site.nodes.read(threads=3)
        fetched = np.concatenate([np.arange(first, last + 1) for _, first, last in self.server.answered])
        self.assertEqual(len(np.unique(fetched)), len(fetched))
        self.assertLessEqual(len(fetched), (self.path / "nodes.bin").stat().st_size)

    def test_closing_while_others_read_lets_them_end(self):
        self.server.delay_s = 0.005
        for _ in range(5):
            site = self.open()
            self.server.answered.clear()
            outcomes = []

            def read(site=site, outcomes=outcomes):
                try:
                    outcomes.append(len(site.level(-1).read(threads=2)))
                except cairn.UsageError as error:
                    outcomes.append(str(error))

            readers = [threading.Thread(target=read) for _ in range(3)]
            for reader in readers:
                reader.start()
            while not self.server.answered:
                time.sleep(0.001)
            site.close()
            for reader in readers:
                reader.join(60)
                self.assertFalse(reader.is_alive())
            self.assertEqual(len(outcomes), 3)
            self.assertTrue(set(outcomes) <= {20_000, "the dataset is closed"}, outcomes)


class Kept(ServedCase):
    def asked_for(self, **options):
        """How many bytes of files opening and reading all takes."""
        self.server.answered.clear()
        site = self.open(**options)
        self.assert_same_points(site.nodes.read(), self.site.nodes.read())
        site.close()
        return sum(last + 1 - first for _, first, last in self.server.answered)

    def test_a_second_time_almost_nothing_is_asked_for(self):
        most = 0.7 * sum((self.path / name).stat().st_size for name in ("index.bin", "metadata.json", "nodes.bin"))
        options = {"web_cache": FOLDER / "kept"}
        self.assertGreater(self.asked_for(**options), most)
        self.assertLessEqual(self.asked_for(**options), 1)
        self.assertGreater(self.asked_for(), most)
        with self.open(**options) as site:
            other = pickle.loads(pickle.dumps(site))
            self.server.answered.clear()
            self.assert_same_points(other.nodes.read(), self.site.nodes.read())
            self.assertEqual(self.server.answered, [])
            other.close()

    def test_unless_told_otherwise_it_is_kept_where_the_program_keeps_it(self):
        cache = FOLDER / "home" / ".cache" / "cairn"
        changes = mock.patch.dict(os.environ, {"HOME": str(FOLDER / "home"), "XDG_CACHE_HOME": ""})
        changes.start()
        self.addCleanup(changes.stop)
        code = "import sys, cairn; print(len(cairn.open(sys.argv[1]).nodes.read()))"
        printed, complaint = python(code, self.url).communicate(timeout=60)
        self.assertEqual((printed, complaint), ("26573\n", ""))
        self.assertGreater(len(list(cache.iterdir())), 85)
        self.server.answered.clear()
        subprocess.run([PROGRAM, "info", self.url], check=True, stdout=subprocess.DEVNULL)
        self.assertLessEqual(sum(last + 1 - first for _, first, last in self.server.answered), 1)

    def test_the_folder_keeps_its_limit(self):
        folder = FOLDER / "small"
        self.asked_for(web_cache=folder, web_cache_bytes=200_000)
        self.assertLess(sum(entry.stat().st_size for entry in folder.iterdir()), 400_000)

    def test_a_folder_that_cannot_be_is_refused(self):
        file = FOLDER / "file"
        file.touch()
        self.refusal(lambda: self.open(web_cache=file), cairn.AccessError)
        # The folder that nobody named is done without.
        with mock.patch.dict(os.environ, {"XDG_CACHE_HOME": str(file)}):
            self.open(web_cache=True)
        with self.assertRaises(TypeError):
            self.open(web_cache=None)


INTERRUPTED = """
import sys, threading, time
import cairn
site = cairn.open(sys.argv[1], web_cache=False)
print("open", flush=True)
try:
    {read}
except KeyboardInterrupt:
    print("interrupted", flush=True)
sys.stdin.readline()
print(len(site.nodes.read()))
"""


class Interrupted(ServedCase):
    """By Ctrl-C while the server says nothing; it would be given up after a minute and more."""

    def expect_interrupted(self, read):
        """SIGINT ends the call at once; when the server goes on, all can be read."""
        self.server.flowing.clear()
        self.server.stalled.clear()
        process = python(INTERRUPTED.format(read=read), self.url)
        self.addCleanup(process.kill)
        self.assertEqual(process.stdout.readline(), "open\n")
        self.assertTrue(self.server.stalled.wait(20))
        time.sleep(0.2)  # until all threads wait
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        timer = threading.Timer(20, process.kill)
        timer.start()
        self.assertEqual(process.stdout.readline(), "interrupted\n")
        timer.cancel()
        self.assertLess(time.monotonic() - begin, 10)
        self.server.flowing.set()
        printed, complaint = process.communicate("\n", timeout=60)
        self.assertEqual((process.returncode, printed, complaint), (0, "26573\n", ""))

    def test_a_node(self):
        self.expect_interrupted("site.root.read()")

    def test_one_thread(self):
        self.expect_interrupted("site.nodes.read(threads=1)")

    def test_several_threads(self):
        self.expect_interrupted("site.nodes.read(threads=4)")

    def test_a_box(self):
        self.expect_interrupted("site.read_box(site.bounds, threads=2)")

    def test_opening(self):
        silent = threading.Event()
        self.addCleanup(silent.set)
        answer = self.server.RequestHandlerClass

        class Silent(answer):
            def answer(self, path):
                self.server.stalled.set()
                silent.wait()

        self.server.RequestHandlerClass = Silent
        process = python("import sys, cairn; cairn.open(sys.argv[1], web_cache=False)", self.url)
        self.addCleanup(process.kill)
        self.assertTrue(self.server.stalled.wait(20))
        time.sleep(0.2)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=20)
        self.assertLess(time.monotonic() - begin, 10)
        self.assertEqual(process.returncode, -signal.SIGINT)
        self.assertTrue(complaint.endswith("KeyboardInterrupt\n"), complaint)

    def test_handlers_that_raise_nothing_let_it_go_on(self):
        site = self.open()
        self.server.flowing.clear()
        came = []

        def handler(*_):
            came.append(True)
            self.server.flowing.set()

        before = signal.signal(signal.SIGUSR1, handler)
        self.addCleanup(signal.signal, signal.SIGUSR1, before)
        main = threading.get_ident()
        threading.Thread(target=lambda: self.server.stalled.wait() and signal.pthread_kill(main, signal.SIGUSR1)).start()
        self.assert_same_points(site.nodes.read(threads=1), self.site.nodes.read())
        self.assertEqual(came, [True])

    def test_what_a_handler_raises_is_raised(self):
        site = self.open()
        self.server.flowing.clear()

        def handler(*_):
            raise ZeroDivisionError

        before = signal.signal(signal.SIGUSR1, handler)
        self.addCleanup(signal.signal, signal.SIGUSR1, before)
        main = threading.get_ident()
        for threads in (1, 3):
            self.server.stalled.clear()
            with self.assertRaises(ZeroDivisionError):
                threading.Timer(0.3, signal.pthread_kill, (main, signal.SIGUSR1)).start()
                site.nodes.read(threads=threads)


inherited = None  # by processes that are forked


def read_inherited(id):
    points = inherited.node(id).read()
    return points.steps, points["color"]


class Forked(ServedCase):
    """A process has the dataset of its parent, but not the thread that talks to the server."""

    def setUp(self):
        super().setUp()
        global inherited
        inherited = self.open()

    def pool(self):
        pool = multiprocessing.get_context("fork").Pool(2)
        self.addCleanup(pool.join)
        self.addCleanup(pool.terminate)
        return pool

    def test_a_dataset_is_read_in_processes_that_inherit_it(self):
        inherited.root.read()
        for id, (steps, color) in enumerate(self.pool().map_async(read_inherited, range(30)).get(60)):
            np.testing.assert_array_equal(steps, self.site.node(id).read().steps)
            np.testing.assert_array_equal(color, self.site.node(id).read()["color"])
        self.assertEqual(len(inherited.level(-1).read()), 20_000)  # here it works on

    def exit_code(self, target):
        process = multiprocessing.get_context("fork").Process(target=target)
        process.start()
        self.addCleanup(process.kill)
        process.join(30)
        return process.exitcode

    def test_a_process_may_close_what_it_inherits_or_let_go_of_it(self):
        def let_go():
            global inherited
            inherited = None

        for end in (inherited.close, let_go, lambda: None):
            self.assertEqual(self.exit_code(end), 0)
        self.assertEqual(len(inherited.root.read()), 313)

    def test_a_process_may_begin_while_its_parent_reads(self):
        global inherited
        self.server.delay_s = 0.02
        for _ in range(3):
            inherited = self.open()
            reader = threading.Thread(target=lambda: inherited.nodes.read(threads=3))
            reader.start()
            for _ in range(3):
                self.assertEqual(self.exit_code(lambda: inherited.level(1).read()), 0)
            reader.join()

    def test_a_process_may_begin_while_another_thread_computes(self):
        computing, ended = threading.Event(), threading.Event()
        self.addCleanup(ended.set)

        class SlowGrid:
            def world(self, steps):
                computing.set()
                ended.wait()

        points = inherited.root.read()
        points.grid = SlowGrid()
        threading.Thread(target=lambda: points.xyz).start()
        computing.wait()
        self.assertEqual(self.exit_code(lambda: inherited.root.read().xyz), 0)

    def test_another_dataset_in_its_place_is_refused(self):
        global inherited
        path = copy_of(self.path, "replaced")
        inherited = cairn.open(self.server.url(path), web_cache=False)
        self.addCleanup(inherited.close)
        write_las(FOLDER / "other.las", survey_records(2000, seed=3))
        other = build("other", FOLDER / "other.las")
        for file in ("index.bin", "metadata.json", "nodes.bin"):
            (path / file).write_bytes((other / file).read_bytes())
        with self.assertRaises(cairn.InputError) as caught:
            self.pool().apply_async(read_inherited, (0,)).get(60)
        self.assertIn("has changed since it was opened", str(caught.exception))


LET_GO = """
import sys, threading, time
import cairn
site = cairn.open(sys.argv[1], web_cache=sys.argv[2])
reader = threading.Thread(target=site.root.read, args=([],))
reader.start()
time.sleep(0.2)
site.close()
longest, begin = 0, time.monotonic()
last = begin
while reader.is_alive():
    time.sleep(0.005)
    now = time.monotonic()
    longest, last = max(longest, now - last), now
print(longest, last - begin)
"""


class LetGo(ServedCase):
    def test_other_threads_run_while_the_last_who_reads_closes_it(self):
        """Closing waits for the dataset's own thread, which writes what came to a disk that takes half a second a call."""
        cache = FOLDER / "slow"
        slow = {"LD_PRELOAD": FAULTS, "CAIRN_FAULT": "slow", "CAIRN_FAULT_AT": "1", "CAIRN_FAULT_FOLDER": str(cache)}
        self.server.delay_s = 0.4
        with mock.patch.dict(os.environ, slow):
            process = python(LET_GO, self.url, cache)
        printed, complaint = process.communicate(timeout=120)
        self.assertEqual(complaint, "")
        longest, whole = map(float, printed.split())
        self.assertLess(longest, whole / 2)


if __name__ == "__main__":
    unittest.main()
