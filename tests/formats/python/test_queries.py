"""Boxes against brute force over the points that were written, and cuts against what a cut promises."""
import itertools
import struct
import subprocess
import unittest

import numpy as np

import cairn
from support import FOLDER, OFFSET, PROGRAM, SCALE, SurveyCase, build, sorted_rows, survey_records, write_las


class Boxes(SurveyCase):
    def inside(self, box):
        return ((self.xyz >= box[0]) & (self.xyz <= box[1])).all(axis=1)

    def expect_points_of(self, box):
        """All records in the box and no other, with their attributes; returns how many."""
        points = self.site.read_box(box, attributes=["intensity", "gps_time"])
        expected = self.records[self.inside(np.asarray(box))]
        found = np.rint((points.xyz - OFFSET) / SCALE)
        np.testing.assert_array_equal(
            sorted_rows(found, points["intensity"], points["gps_time"]),
            sorted_rows(expected["steps"], expected["intensity"], expected["gps_time"]))
        return len(points)

    def test_random_boxes_hold_the_points_that_brute_force_finds(self):
        random = np.random.default_rng(11)
        low, high = self.site.bounds
        counts = []
        for _ in range(40):
            # Between two steps, so that no rounding decides.
            corners = np.sort(np.floor(random.uniform(low, high, (2, 3)) / 0.01) * 0.01 + 0.0005, axis=0)
            counts.append(self.expect_points_of(corners))
        self.assertGreater(max(counts), 500)

    def test_all_nothing_and_a_single_point(self):
        self.assertEqual(self.expect_points_of(self.site.bounds), len(self.records))
        self.assertEqual(self.expect_points_of(self.site.bounds + 1e6), 0)
        self.assertEqual(len(self.site.in_box(self.site.bounds + 1e6)), 0)
        position = self.site.node(50).read([]).xyz[17]
        alone = self.site.read_box([position, position])
        np.testing.assert_array_equal(np.unique(alone.xyz, axis=0), [position])

    def test_sides_belong_to_a_box(self):
        low, high = self.site.bounds
        for axis in range(3):
            side = np.array([low, high])
            side[0, axis] = side[1, axis]  # the plane that the farthest points lie on
            points = self.site.read_box(side)
            self.assertEqual(len(points), (self.records["steps"][:, axis] == self.records["steps"][:, axis].max()).sum())

    def test_two_coordinates_take_any_height(self):
        box = self.site.bounds.mean(axis=0) + [[-20, -30, 0], [25, 10, 0]]
        self.assertEqual(len(self.site.read_box(box[:, :2])),
                         self.inside(np.column_stack([box[:, :2], [-np.inf, np.inf]])).sum())

    def test_nodes_that_meet_a_box_are_those_whose_boxes_do(self):
        box = self.site.bounds.mean(axis=0) + np.array([[-30, -30, -5], [10, 20, 5]])
        for level in range(self.site.level_count):
            expected = [node.id for node in self.site.level(level)
                        if all(node.box[0][a] <= box[1][a] and node.box[1][a] >= box[0][a] for a in range(3))]
            self.assertEqual(self.site.in_box(box, level).ids.tolist(), expected)

    def test_a_coarser_level_is_cut_by_the_same_box(self):
        box = self.site.bounds.mean(axis=0) + np.array([[-40, -40, -50], [40, 40, 50]])
        points = self.site.read_box(box, level=1, attributes=["color"])
        every = self.site.level(1).read(["color"])
        chosen = ((every.xyz >= box[0]) & (every.xyz <= box[1])).all(axis=1)
        self.assertTrue(0 < chosen.sum() < len(every))
        np.testing.assert_array_equal(points.xyz, every.xyz[chosen])
        np.testing.assert_array_equal(points["color"], every["color"][chosen])
        np.testing.assert_array_equal(points.weight, every.weight[chosen])

    def test_a_box_over_leaves_and_inner_nodes_keeps_weights(self):
        nodes = self.site.nodes[[0, 84, 60]]
        box = [self.site.bounds[0] - 1, self.site.bounds[1] + 1]
        points = nodes.read([], box=box)
        np.testing.assert_array_equal(points.weight, nodes.read([]).weight)
        self.assertEqual(points.weight.sum(), len(self.records) + nodes[1:].point_count)

    def test_what_is_no_box_is_refused(self):
        low, high = self.site.bounds
        self.assertIn("begins with its least corner", self.refusal(lambda: self.site.read_box([high, low])))
        self.assertIn("begins with its least corner", self.refusal(lambda: self.site.in_box([low, high * np.nan])))
        self.assertIn("shape (3,)", self.refusal(lambda: self.site.in_box(low)))
        self.assertIn("two corners of numbers", self.refusal(lambda: self.site.in_box([["a", "b", "c"]] * 2)))


class Budgets(SurveyCase):
    def covered(self, cut):
        """How many nodes of the cut each leaf is or lies below."""
        counts = {leaf.id: 0 for leaf in self.site.level(-1)}
        for node in cut:
            below = [node]
            while not below[0].is_leaf:
                below = [child for inner in below for child in inner.children]
            for leaf in below:
                counts[leaf.id] += 1
        return counts

    def test_every_cut_covers_every_leaf_once_within_the_budget_and_as_finely_as_it_can(self):
        for by in ("rms", "bound"):
            for budget in (313, 314, 1000, 1251, 1252, 1253, 5000, 12_345, 19_999):
                cut = self.site.budget(budget, by=by)
                self.assertEqual(set(self.covered(cut).values()), {1})
                self.assertLessEqual(cut.point_count, budget)
                self.assertEqual(cut.weight, len(self.records))
                for node in cut:
                    if not node.is_leaf:
                        refined = cut.point_count - node.point_count + node.children.point_count
                        self.assertGreater(refined, budget, f"{node} could be refined")

    def test_less_than_what_refining_a_node_adds_stays_unused(self):
        for by in ("rms", "bound"):
            for budget in range(313, 20_000, 487):
                unused = budget - self.site.budget(budget, by=by).point_count
                self.assertLess(unused, (4 - 1) * 313)

    def test_an_export_comes_within_a_node_of_the_budget(self):
        for budget in (1500, 5000, 11_000):
            file = FOLDER / "budget.las"
            subprocess.run([PROGRAM, "export", self.path, "-o", file, "--budget", str(budget), "--force", "--progress",
                            "none"], check=True, stdout=subprocess.DEVNULL)
            exported, = struct.unpack_from("<I", file.read_bytes(), 107)  # of LAS 1.2; of 1.4 where the format allows
            self.assertGreater(exported, budget - 313)
            self.assertLessEqual(exported, budget)

    def test_the_least_is_the_root_and_the_most_all_leaves(self):
        self.assertEqual(self.site.budget(313).ids.tolist(), [0])
        self.assertEqual(self.site.budget(20_000).ids.tolist(), self.site.level(-1).ids.tolist())
        self.assertEqual(self.site.budget(10**30).ids.tolist(), self.site.level(-1).ids.tolist())

    def test_a_budget_below_the_root_is_refused(self):
        for budget in (312, 0, -5):
            self.assertIn("the least that shows all: 313", self.refusal(lambda budget=budget: self.site.budget(budget)))
        self.assertIn('found "level"', self.refusal(lambda: self.site.budget(1000, by="level")))
        with self.assertRaises(TypeError):
            self.site.budget(1e6)

    def test_more_points_never_show_less(self):
        for by in ("rms", "bound"):
            cuts = [self.site.budget(budget, by=by) for budget in range(313, 20_001, 940)]
            errors = [getattr(cut, by) for cut in cuts]
            self.assertEqual(errors, sorted(errors, reverse=True))

    def test_the_points_of_a_cut_stand_for_all_input_points(self):
        points = self.site.budget(5000).read(["color"])
        self.assertLessEqual(len(points), 5000)
        self.assertEqual(points.weight.sum(), len(self.records))

    def test_a_box_spends_the_budget_on_what_meets_it(self):
        low, high = self.site.bounds
        box = np.array([low, low + 0.3 * (high - low)])
        box[1, 2] = high[2]
        meets = [node.id for node in self.site.in_box(box)]
        for budget in (313, 1000, 2500, 20_000):
            cut = self.site.budget(budget, box=box)
            self.assertLessEqual(cut.point_count, budget)
            counts = self.covered(cut)
            self.assertTrue(all(counts[leaf] == 1 for leaf in meets))
            self.assertTrue(all(self.site.in_box(box, node.level).ids.tolist().count(node.id) for node in cut))
        self.assertEqual(cut.ids.tolist(), meets)
        self.assertEqual(len(self.site.budget(100, box=np.add(self.site.bounds, 1e6))), 0)


def cuts_below(node):
    """All cuts through the subtree of a node."""
    yield [node]
    if not node.is_leaf:
        for parts in itertools.product(*(list(cuts_below(child)) for child in node.children)):
            yield [inner for part in parts for inner in part]


class BestCuts(unittest.TestCase):
    """Against all cuts through a small tree whose refinements all cost the same."""

    @classmethod
    def setUpClass(cls):
        write_las(FOLDER / "small.las", survey_records(1600, seed=5))
        cls.site = cairn.open(build("small", FOLDER / "small.las", "--lossless-leaves", "--fanout", "2",
                                    "--node-points", "100"))
        cls.cuts = [cairn.Nodes(cls.site, [node.id for node in cut]) for cut in cuts_below(cls.site.root)]

    def test_there_are_as_many_cuts_as_there_should_be(self):
        self.assertEqual((self.site.level_count, self.site.node_points), (5, 100))
        self.assertEqual(len(self.cuts), 677)  # c(0) = 1, c(h) = 1 + c(h - 1)^2

    def best(self, budget, by):
        return min(getattr(cut, by) for cut in self.cuts if cut.point_count <= budget)

    def test_no_cut_has_a_smaller_bound(self):
        for budget in range(100, 1700, 100):
            self.assertEqual(self.site.budget(budget, by="bound").bound, self.best(budget, "bound"))

    def test_hardly_any_cut_has_a_smaller_rms(self):
        for budget in range(100, 1700, 100):
            self.assertLessEqual(self.site.budget(budget).rms, 1.02 * self.best(budget, "rms"))


if __name__ == "__main__":
    unittest.main()
