"""Points come back as they were written, in arrays that stand by themselves."""
import gc
import pickle
import unittest
import weakref

import numpy as np

import cairn
from support import FOLDER, LAS_RECORD, OFFSET, SCALE, SurveyCase, build, shared_scan, sorted_rows, write_ply


class LosslessPoints(SurveyCase):
    def test_leaves_hold_every_field_of_every_record(self):
        points = self.site.level(-1).read()
        self.assertEqual(len(points), len(self.records))
        ours = sorted_rows(np.rint((points.xyz - OFFSET) / SCALE), points["intensity"], points["classification"],
                           points["user_data"], points["gps_time"], points["color"])
        theirs = sorted_rows(self.records["steps"], self.records["intensity"], self.records["classification"],
                             self.records["user_data"], self.records["gps_time"], self.records["color"])
        np.testing.assert_array_equal(ours, theirs)

    def test_world_coordinates_are_those_of_the_las_formula(self):
        found = sorted_rows(self.site.level(-1).read([]).xyz)
        np.testing.assert_allclose(found, sorted_rows(self.xyz), rtol=0, atol=1e-8)

    def test_types_and_shapes_are_those_of_the_schema(self):
        points = self.site.root.children.read()
        n = len(points)
        self.assertEqual((points.xyz.dtype, points.xyz.shape), (np.float64, (n, 3)))
        self.assertEqual((points.steps.dtype, points.steps.shape), (np.int32, (n, 3)))
        self.assertEqual((points["color"].dtype, points["color"].shape), (np.uint16, (n, 3)))
        self.assertEqual((points["intensity"].dtype, points["intensity"].shape), (np.uint16, (n,)))
        self.assertEqual((points.radius.dtype, points.radius.shape), (np.float32, (n,)))
        self.assertEqual((points.weight.dtype, points.weight.shape), (np.uint64, (n,)))

    def test_weights_of_each_level_add_up_to_all_input_points(self):
        for level in range(self.site.level_count):
            self.assertEqual(self.site.level(level).read([]).weight.sum(), len(self.records))

    def test_real_survey_is_the_file_that_numpy_reads(self):
        scan = shared_scan("las/autzen_trim.las")
        data = scan.read_bytes()
        start, = np.frombuffer(data, "<u4", 1, 96)
        length, = np.frombuffer(data, "<u2", 1, 105)
        count, = np.frombuffer(data, "<u4", 1, 107)
        scale, offset = np.frombuffer(data, "<f8", 3, 131), np.frombuffer(data, "<f8", 3, 155)
        self.assertEqual((data[104], length), (3, LAS_RECORD.itemsize))
        records = np.frombuffer(data, LAS_RECORD, count, start)
        with cairn.open(build("trim", scan, "--lossless-leaves", "--node-points", "8000")) as site:
            self.assertGreater(site.level_count, 1)
            points = site.level(-1).read()
        steps = np.rint((points.xyz - offset) / scale)
        np.testing.assert_array_equal(
            sorted_rows(steps, points["intensity"], points["color"], points["gps_time"]),
            sorted_rows(records["steps"], records["intensity"], records["color"], records["gps_time"]))


class NormalsAndRadii(unittest.TestCase):
    def test_columns_that_a_scan_brings_are_there_by_name(self):
        random = np.random.default_rng(3)
        xyz = random.uniform(-1, 1, (5000, 3)).astype(np.float32)
        normal = xyz / np.linalg.norm(xyz, axis=1, keepdims=True)
        radius = random.uniform(0.01, 0.02, 5000).astype(np.float32)
        write_ply(FOLDER / "ball.ply", xyz=xyz, normal=normal, radius=radius)
        site = cairn.open(build("ball", FOLDER / "ball.ply", "--lossless-leaves", "--node-points", "500"))
        self.assertEqual(list(site.attributes), ["normal", "radius"])
        self.assertFalse(site.attributes["radius"].estimated)
        points = site.level(-1).read()
        # Positions go to the nearest step of a grid that is much finer than a float32.
        np.testing.assert_array_equal(sorted_rows(points.normal, points.radius), sorted_rows(normal, radius))
        np.testing.assert_allclose(sorted_rows(points.xyz), sorted_rows(xyz), rtol=0, atol=max(site.grid.step))
        np.testing.assert_array_less(points.steps.max(axis=0) - points.steps.min(axis=0), 2**30 + 1)
        coarse = site.root.read(["normal"])
        np.testing.assert_allclose(np.linalg.norm(coarse.normal, axis=1), 1, atol=1e-6)


class Arrays(SurveyCase):
    def test_columns_of_a_node_are_its_memory_without_a_copy(self):
        points = self.site.node(9).read()
        for column in [points.steps, *points.columns.values()]:
            self.assertIsNone(getattr(column.base, "base", None), "a view of another array")
            self.assertEqual(type(column.base).__name__, "PyCapsule")
            self.assertTrue(column.flags.c_contiguous and column.flags.aligned and column.flags.writeable)

    def test_arrays_live_on_without_node_and_dataset(self):
        site = cairn.open(self.path)
        points = site.node(30).read()
        color, steps, gps = points["color"], points.steps, points["gps_time"]
        before = color.copy(), steps.copy(), gps.copy()
        gone = weakref.ref(site)
        site.close()
        del site, points
        gc.collect()
        self.assertIsNone(gone())
        churn = [np.full(100_000, 7, np.uint8) for _ in range(50)]  # whatever was freed is used again
        del churn
        for array, copy in zip((color, steps, gps), before):
            np.testing.assert_array_equal(array, copy)
            array[:] = 0  # and writing into it harms nobody
        np.testing.assert_array_equal(self.site.node(30).read().steps, before[1])

    def test_each_read_is_a_new_array(self):
        node = self.site.node(3)
        node.read()["color"][:] = 0
        self.assertTrue(node.read()["color"].any())

    def test_xyz_is_computed_once(self):
        points = self.site.root.read()
        self.assertIs(points.xyz, points.xyz)
        np.testing.assert_array_equal(self.site.grid.world(points.steps), points.xyz)

    def test_slices_masks_and_indices_select_points(self):
        points = self.site.root.read(representative=False)
        mask = points["intensity"] > 30_000
        for key in (slice(10, 50, 3), mask, [4, 2, 2], np.array([], int), []):
            chosen = points[key]
            rows = key if not isinstance(key, list) else np.array(key, int)
            np.testing.assert_array_equal(chosen.xyz, points.xyz[rows])
            np.testing.assert_array_equal(chosen.weight, points.weight[rows])
            np.testing.assert_array_equal(chosen["color"], points["color"][rows])
        leaf = self.site.level(-1)[0].read()
        self.assertEqual(leaf[:5].weight.tolist(), [1] * 5)

    def test_structured_array_has_a_field_a_column(self):
        points = self.site.node(5).read(["color", "intensity"])
        records = points.to_structured()
        self.assertEqual(records.dtype.names, ("x", "y", "z", "color", "intensity"))
        np.testing.assert_array_equal(records["y"], points.xyz[:, 1])
        np.testing.assert_array_equal(records["color"], points["color"])

    def test_attributes_named_like_an_axis_keep_their_values(self):
        grid = self.site.grid
        columns = {"x": np.arange(4), "x_": np.arange(4) * 10, "weight": np.arange(4) * 100}
        points = cairn.Points(np.zeros((4, 3), np.int32), grid, columns)
        records = points.to_structured()
        self.assertEqual(records.dtype.names, ("x", "y", "z", "x__", "x_", "weight"))
        np.testing.assert_array_equal(records["x__"], columns["x"])
        np.testing.assert_array_equal(records["x_"], columns["x_"])

    def test_points_can_be_pickled(self):
        points = self.site.node(2).read()
        back = pickle.loads(pickle.dumps(points))
        np.testing.assert_array_equal(back.xyz, points.xyz)
        np.testing.assert_array_equal(back["color"], points["color"])


class Wanted(SurveyCase):
    def test_only_what_is_asked_for_is_read(self):
        points = self.site.node(1).read(["intensity", "intensity", "color"], weight=False)
        self.assertEqual(list(points.columns), ["intensity", "color"])
        self.assertIn("weights were not read", self.refusal(lambda: points.weight))
        self.assertIn("representatives were not read", self.refusal(lambda: points.representative))
        self.assertIn('"radius" was not read', self.refusal(lambda: points.radius))
        self.assertEqual(list(self.site.node(1).read("color").columns), ["color"])

    def test_inner_nodes_have_what_is_reduced_and_leaves_all(self):
        rules = {name: attribute.rule for name, attribute in self.site.attributes.items()}
        self.assertEqual(rules["gps_time"], "none")
        self.assertEqual(rules["color"], "mean")
        self.assertEqual(rules["classification"], "majority")
        self.assertEqual(rules["radius"], "cover_radius")
        self.assertEqual(list(self.site.level(-1)[3].read().columns), list(rules))
        self.assertEqual(list(self.site.root.read().columns), [name for name in rules if rules[name] != "none"])
        mixed = self.site.nodes[[0, self.site.node_count - 1]].read()
        self.assertNotIn("gps_time", mixed)
        self.assertEqual(mixed.weight[-1], 1)

    def test_what_is_not_there_is_refused_by_name(self):
        self.assertIn('no attribute "colour": the dataset has', self.refusal(lambda: self.site.root.read(["colour"])))
        self.assertIn('"gps_time" is kept in the leaves only, which node 0 is not',
                      self.refusal(lambda: self.site.nodes.read(["color", "gps_time"])))
        self.assertIn("the root has no representatives", self.refusal(lambda: self.site.root.read(representative=True)))
        self.assertIn("0 threads", self.refusal(lambda: self.site.nodes.read(threads=0)))
        self.assertIn("shape (n, 3)", self.refusal(lambda: self.site.grid.world([1, 2, 3])))
        for steps in ([[0, 0, 2**31]], [[0.5, 0, 0]], [[0, np.nan, 0]], [[0, 0, -(2**63)]]):
            self.assertIn("whole numbers of 32 bits", self.refusal(lambda steps=steps: self.site.grid.world(steps)))
        points = self.site.root.read()
        self.assertIn("a slice, a mask or a list", self.refusal(lambda: points[3]))
        with self.assertRaises(TypeError):
            iter(points)

    def test_no_nodes_have_no_points(self):
        points = self.site.nodes[[]].read()
        self.assertEqual((len(points), points.xyz.shape, points["color"].shape), (0, (0, 3), (0, 3)))


if __name__ == "__main__":
    unittest.main()
