"""Whatever is wrong with a dataset is an exception with one line, and never more than that."""
import errno
import os
import pathlib
import pickle
import unittest

import numpy as np

import cairn
from support import FOLDER, SurveyCase, copy_of


class Damage(SurveyCase):
    counter = 0

    def damaged(self, file, change):
        """The path of a copy of which one file was changed."""
        Damage.counter += 1
        path = copy_of(self.path, f"damaged-{Damage.counter}")
        data = bytearray((path / file).read_bytes())
        (path / file).write_bytes(change(data))
        return path

    @staticmethod
    def flip(offset):
        def change(data):
            data[offset] ^= 0x10
            return data
        return change

    def test_a_flipped_byte_of_the_index_or_metadata_is_refused_when_opened(self):
        for file in ("index.bin", "metadata.json"):
            size = (self.path / file).stat().st_size
            for offset in range(0, size, size // 12):
                path = self.damaged(file, self.flip(offset))
                self.assertIn(str(path), self.refusal(lambda: cairn.open(path), cairn.InputError))

    def test_a_flipped_byte_of_a_node_is_refused_when_it_is_read(self):
        node = self.site.node(20)
        site = cairn.open(self.damaged("nodes.bin", self.flip(int(node["offset"]))))
        for read in (site.node(20).read, site.nodes.read, site.level(2).read, site.nodes[15:30].read,
                     lambda: site.level(2).read(threads=3), lambda: site.read_box(site.bounds, level=2)):
            with self.assertRaises(cairn.InputError) as caught:
                read()
            self.assertIn("section 0 of node 20", str(caught.exception))
            self.assertEqual(caught.exception.path, f"{site.source}/nodes.bin")
            self.assertEqual(caught.exception.offset, int(node["offset"]))
            self.assertIsNotNone(caught.exception.found)
        np.testing.assert_array_equal(site.node(21).read().steps, self.site.node(21).read().steps)  # others as before

    def test_files_that_end_early_are_refused(self):
        for file in ("index.bin", "nodes.bin", "metadata.json"):
            for keep in (0, 8, 1000):
                path = self.damaged(file, lambda data, keep=keep: data[:keep])
                self.refusal(lambda: cairn.open(path), cairn.InputError)

    def test_a_file_that_shrinks_while_it_is_open_is_refused(self):
        path = copy_of(self.path, "shrinking")
        site = cairn.open(path)
        os.truncate(path / "nodes.bin", 100)
        self.assertIn("the file ends too early", self.refusal(site.level(-1).read, cairn.InputError))

    def test_what_is_not_there_is_an_os_error(self):
        missing = FOLDER / "missing.cairn"
        with self.assertRaises(OSError) as caught:
            cairn.open(missing)
        error = caught.exception
        self.assertIsInstance(error, cairn.AccessError)
        self.assertEqual((error.errno, error.filename), (errno.ENOENT, f"{missing}/index.bin"))
        self.assertEqual(str(error), f"cannot open {missing}/index.bin: No such file or directory")

    def test_errors_can_be_pickled(self):
        for location in (FOLDER / "missing.cairn", self.damaged("index.bin", self.flip(30))):
            with self.assertRaises(cairn.Error) as caught:
                cairn.open(location)
            back = pickle.loads(pickle.dumps(caught.exception))
            self.assertEqual((type(back), str(back), back.path), (type(caught.exception), str(caught.exception),
                                                                   caught.exception.path))

    def test_kinds_are_what_python_users_catch(self):
        self.assertTrue(issubclass(cairn.UsageError, ValueError))
        self.assertTrue(issubclass(cairn.AccessError, OSError))
        for kind in (cairn.UsageError, cairn.InputError, cairn.AccessError, cairn.InvariantError):
            self.assertTrue(issubclass(kind, cairn.Error))


class Locations(SurveyCase):
    def test_text_and_paths_are_the_same_place(self):
        for location in (str(self.path), pathlib.PurePosixPath(self.path), self.path, os.fsencode(self.path)):
            site = cairn.open(location)
            self.assertEqual((site.source, site.point_count), (str(self.path), 20_000))

    def test_names_that_are_no_text_are_opened_and_told(self):
        name = os.fsdecode(b"caf\xe9 \xc3\xa9")
        path = copy_of(self.path, name)
        self.assertEqual(cairn.open(path).point_count, 20_000)
        (path / "index.bin").unlink()
        self.assertIn(name, self.refusal(lambda: cairn.open(path), cairn.AccessError))

    def test_what_is_no_path_is_refused(self):
        self.assertIn("zero byte", self.refusal(lambda: cairn.open(f"{self.path}\0.cairn")))
        for nothing in (None, 5, object()):
            with self.assertRaises(TypeError):
                cairn.open(nothing)


class Closed(SurveyCase):
    def test_a_closed_dataset_reads_no_more(self):
        with cairn.open(self.path) as site:
            points = site.node(4).read(["color"])
            nodes = site.level(1)
        self.assertTrue(site.closed)
        for call in (nodes.read, site.node(4).read, lambda: site.metadata, lambda: site.node(4).blocks):
            self.assertEqual(self.refusal(call), "the dataset is closed")
        self.assertIn("closed", repr(site))
        self.assertEqual(len(points.xyz), 313)
        site.close()  # again is no error

    def test_closing_gives_the_file_back(self):
        def open_files():
            return [os.readlink(f"/proc/self/fd/{fd}") for fd in os.listdir("/proc/self/fd")
                    if os.path.exists(f"/proc/self/fd/{fd}")]

        before = open_files().count(f"{self.path}/nodes.bin")
        site = cairn.open(self.path)
        self.assertEqual(open_files().count(f"{self.path}/nodes.bin"), before + 1)
        site.close()
        self.assertEqual(open_files().count(f"{self.path}/nodes.bin"), before)


if __name__ == "__main__":
    unittest.main()
