"""What is told of a dataset and of its nodes, held against the files and against the points themselves."""
import json
import pickle
import re
import subprocess
import sys
import unittest

import numpy as np

import cairn
from support import FOLDER, PROGRAM, SOURCE, SurveyCase, build, write_ply


class Package(unittest.TestCase):
    def test_its_version_is_that_of_the_program(self):
        printed = subprocess.run([PROGRAM, "--version"], check=True, stdout=subprocess.PIPE, text=True).stdout
        self.assertIn(cairn.__version__, printed.split())
        told = re.search(r"(?m)^project\(cairn VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8"))
        self.assertEqual(cairn.__version__, told[1])


class WhatADatasetTells(SurveyCase):
    def test_the_tree_follows_from_the_points(self):
        # n = 20,000 and s = 320 on fan-out 4: the level nearest to log4(62.5) = 2.98 is 3, s' = ceil(n / 64).
        site = self.site
        self.assertEqual((site.point_count, site.fanout, site.level_count, site.node_points, site.target_points),
                         (20_000, 4, 4, 313, 320))
        self.assertEqual(site.node_count, 1 + 4 + 16 + 64)
        self.assertTrue(site.lossless and site.replaces)

    def test_bounds_are_those_of_the_scans(self):
        np.testing.assert_allclose(self.site.bounds, [self.xyz.min(axis=0), self.xyz.max(axis=0)], rtol=0, atol=1e-8)

    def test_metadata_and_crs_are_told(self):
        with open(self.path / "metadata.json", encoding="utf-8") as file:
            self.assertEqual(self.site.metadata, json.load(file))
        self.assertEqual([source["name"] for source in self.site.metadata["sources"]], ["west.las", "east.las"])
        self.assertEqual(self.site.crs, self.site.metadata["crs"]["wkt"])

    def test_there_need_not_be_a_crs(self):
        write_ply(FOLDER / "three.ply", xyz=np.eye(3, dtype=np.float32))
        site = cairn.open(build("three", FOLDER / "three.ply"))
        self.assertIsNone(site.crs)
        self.assertEqual((site.level_count, site.node_count, site.root.is_leaf), (1, 1, True))
        self.assertEqual(len(site.root.children), 0)
        self.assertEqual(len(site.budget(3).read()), 3)
        self.assertEqual(site.root.blocks, (slice(0, 3),))
        self.assertEqual(list(site.attributes), ["radius"])

    def test_text_for_people_tells_the_main_things(self):
        self.assertIn("20,000 points, fan-out 4, 4 levels, 85 nodes", repr(self.site))
        self.assertIn("color uint16 x 3", repr(self.site))
        self.assertIn("level 0, 4 children, 313 points for 20,000", repr(self.site.root))
        self.assertIn("16 of level 2, 5,008 points for 20,000", repr(self.site.level(2)))
        self.assertIn("20,000 points with", repr(self.site.level(-1).read()))
        self.assertEqual(repr(self.site.nodes[[]]), "<cairn.Nodes: none>")

    def test_a_dataset_goes_to_other_processes(self):
        other = pickle.loads(pickle.dumps(self.site.node(7)))
        self.assertEqual(other.id, 7)
        np.testing.assert_array_equal(other.read().steps, self.site.node(7).read().steps)


class Tree(SurveyCase):
    def test_children_know_their_parents(self):
        seen = []
        for level in range(self.site.level_count):
            for node in self.site.level(level):
                self.assertEqual(node.level, level)
                seen.append(node.id)
                for child in node.children:
                    self.assertEqual(child.parent, node)
                    self.assertEqual(child.level, level + 1)
                    self.assertTrue((child.box[0] >= node.box[0]).all() and (child.box[1] <= node.box[1]).all())
                self.assertEqual(sum(child.weight for child in node.children), 0 if node.is_leaf else node.weight)
        self.assertEqual(seen, list(range(85)))
        self.assertIsNone(self.site.root.parent)

    def test_nodes_are_selected_like_an_array(self):
        nodes = self.site.nodes
        self.assertEqual(nodes[nodes["level"] == 1].ids.tolist(), [1, 2, 3, 4])
        self.assertEqual(nodes[1:3].ids.tolist(), [1, 2])
        self.assertEqual(nodes[[84, 2]].ids.tolist(), [84, 2])
        self.assertEqual(nodes[-1], self.site.node(84))
        self.assertIn(self.site.node(3), nodes[2:5])
        self.assertNotIn(self.site.node(5), nodes[2:5])
        self.assertEqual(len({self.site.node(3), nodes[3], nodes[4]}), 2)
        self.assertEqual(np.asarray(nodes[3:5])["id"].tolist(), [3, 4])
        with self.assertRaises(IndexError):
            nodes[85]

    def test_what_is_not_there_is_refused(self):
        for id in (-1, 85, 2**64, -2**70):
            self.assertIn(f"no node {id}: the dataset has 0 to 84", self.refusal(lambda id=id: self.site.node(id)))
        for level in (4, -5):
            self.assertIn(f"no level {level}", self.refusal(lambda level=level: self.site.level(level)))
        self.assertIn('no field "error" in the table', self.refusal(lambda: self.site.nodes["error"]))

    def test_the_table_cannot_be_spoilt(self):
        self.site.nodes["rms"][:] = -1
        self.site.nodes.table["rms"][:] = -1
        self.site.root.box[:] = 0
        self.assertTrue((self.site.nodes["rms"] >= 0).all())
        self.assertTrue(self.site.bounds.any())


class Table(SurveyCase):
    def test_it_is_what_another_reader_counts_in_the_index(self):
        script = SOURCE / "tests" / "support" / "count_nodes.py"
        levels = json.loads(subprocess.run([sys.executable, script, self.path], check=True, capture_output=True).stdout)
        self.assertEqual(len(levels), self.site.level_count)
        for level, expected in enumerate(levels):
            nodes = self.site.level(level)
            self.assertEqual((len(nodes), nodes.point_count, nodes.weight),
                             (expected["nodes"], expected["points"], expected["weight"]))
            for field, key in (("theta", "theta"), ("grid", "grid"), ("rms", "node_rms"), ("bound", "node_bound")):
                self.assertEqual((nodes[field].min(), nodes[field].max()), (expected[key]["min"], expected[key]["max"]))
            self.assertEqual(dict(zip(self.site.sections, nodes["section_bytes"].sum(axis=0).tolist())),
                             expected["section_bytes"])
            self.assertEqual(nodes["bytes"].sum(), sum(expected["section_bytes"].values()))

    def test_sections_fill_the_file(self):
        table = np.sort(self.site.nodes.table, order="offset")
        ends = np.cumsum(table["bytes"])
        np.testing.assert_array_equal(table["offset"][1:], ends[:-1])
        self.assertEqual(ends[-1], (self.path / "nodes.bin").stat().st_size)

    def test_boxes_hold_their_points_tightly(self):
        for node in self.site.level(-1):
            xyz = node.read([]).xyz
            np.testing.assert_array_equal(node.box, [xyz.min(axis=0), xyz.max(axis=0)])
        grid_boxes = self.site.nodes["grid_box"].reshape(-1, 3)
        np.testing.assert_array_equal(self.site.grid.world(grid_boxes).reshape(-1, 2, 3), self.site.nodes["box"])

    def test_errors_of_a_level_are_those_that_the_program_tells(self):
        told = json.loads(subprocess.run([PROGRAM, "info", "--json", self.path], check=True, capture_output=True).stdout)
        for level, expected in enumerate(told["levels"]):
            self.assertAlmostEqual(self.site.level(level).rms, expected["rms"], delta=1e-12 * expected["rms"])
            self.assertEqual(self.site.level(level).bound, expected["bound"])
        self.assertTrue(np.isnan(self.site.nodes[[]].rms))


class Representatives(SurveyCase):
    def test_they_are_as_far_from_input_points_as_is_recorded(self):
        above = self.site.level(-2)
        squares = 0.0
        for parent in above:
            parents = parent.read([])
            for child, block in zip(parent.children, parent.blocks):
                points = child.read([], representative=True)
                chosen = points.representative
                self.assertTrue((chosen >= block.start).all() and (chosen < block.stop).all())
                # Each stands for as many as its weight tells.
                np.testing.assert_array_equal(np.bincount(chosen, minlength=len(parents))[block], parents.weight[block])
                # From steps: world coordinates of seven digits before the point are rounded to a nanometre.
                steps = points.steps.astype(np.int64) - parents.steps[chosen]
                distance = np.linalg.norm(steps * self.site.grid.step, axis=1)
                self.assertLessEqual(distance.max(), parent.bound)
                squares += (distance**2).sum()
            self.assertEqual(parent.blocks[0].start, 0)
            self.assertEqual(parent.blocks[-1].stop, parent.point_count)
        # What storing rounds is far below the error itself.
        self.assertAlmostEqual(np.sqrt(squares / len(self.records)), above.rms, delta=1e-3 * above.rms)

    def test_many_nodes_give_them_in_the_order_of_their_points(self):
        nodes = self.site.nodes[[9, 40, 3]]
        together = nodes.read([], representative=True)
        np.testing.assert_array_equal(
            together.representative, np.concatenate([node.read([], representative=True).representative for node in nodes]))


if __name__ == "__main__":
    unittest.main()
