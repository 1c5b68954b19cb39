"""The example script and the example of README.md do what they say."""
import importlib.util
import os
import re
import struct
import subprocess
import sys
import unittest

import numpy as np

from support import FOLDER, SOURCE, SurveyCase, build, copy_of, write_ply

SCRIPT = SOURCE / "scripts" / "example_levels.py"
REQUIRED = "CAIRN_SHARED_DATA_REQUIRED" in os.environ  # continuous integration: nothing may be missing

# Runs cells as a notebook's kernel does, whose own arguments are none of theirs; after the first their user names a picture.
NOTEBOOK = """
import re, sys
with open(sys.argv[1], encoding="utf-8") as file:
    head, *cells = re.split("(?m)^# %%", file.read())
sys.argv = ["/usr/lib/python3/dist-packages/ipykernel_launcher.py", "-f", "kernel-1.json"]
names = {"__name__": "__main__"}
for cell in cells:
    exec("#" + cell, names)
    if cell is cells[0]:
        names.update(output="cells.png", budget=5000)
print(len(cells), "cells")
"""


@unittest.skipUnless(REQUIRED or importlib.util.find_spec("matplotlib"), "no matplotlib")
class ExampleScript(SurveyCase):
    def draw(self, *arguments):
        return subprocess.run([sys.executable, SCRIPT, *arguments], env={**os.environ, "MPLBACKEND": "Agg"},
                              capture_output=True, text=True, check=False)

    def expect_picture(self, dataset):
        """What was printed beside a picture whose four panels all hold marks of several colors."""
        import matplotlib.image

        picture = FOLDER / "levels.png"
        outcome = self.draw(dataset, "-o", picture, "--budget", "5000")
        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        self.assertEqual(struct.unpack(">II", picture.read_bytes()[16:24]), (1430, 1100))  # 13 by 10 inches of 110 dots
        pixels = matplotlib.image.imread(picture)[:, :, :3]
        for rows in (slice(100, 480), slice(620, 1000)):
            for columns in (slice(150, 650), slice(850, 1350)):
                panel = pixels[rows, columns].reshape(-1, 3)
                colored = np.ptp(panel, axis=1) > 0.2
                self.assertGreater(colored.mean(), 0.0005)
                self.assertGreater((panel.min(axis=1) > 0.95).mean(), 0.05)
        picture.unlink()
        return outcome.stdout

    def test_it_draws_a_dataset_of_several_levels(self):
        printed = self.expect_picture(self.path)
        rows = [line.split() for line in printed.splitlines() if re.match(r"\s+\d\s", line)]
        self.assertEqual([row[:5] for row in rows],
                         [["0", "1", "313", "313", "313"], ["1", "4", "1,252", "313", "313"],
                          ["2", "16", "5,008", "313", "313"], ["3", "64", "20,000", "312", "313"]])

    def test_it_draws_a_single_node_without_colors(self):
        random = np.random.default_rng(1)
        write_ply(FOLDER / "cube.ply", xyz=random.uniform(0, 1, (3000, 3)).astype(np.float32))
        outcome = self.draw(build("cube", FOLDER / "cube.ply"), "-o", FOLDER / "cube.png")
        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        self.assertGreater((FOLDER / "cube.png").stat().st_size, 10_000)

    def test_its_cells_run_one_by_one(self):
        folder = FOLDER / "notebook"
        folder.mkdir()
        (folder / "site.cairn").symlink_to(self.path)
        outcome = subprocess.run([sys.executable, "-c", NOTEBOOK, SCRIPT], cwd=folder,
                                 env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True, check=False)
        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))
        self.assertEqual(outcome.stdout.splitlines()[-1], "8 cells")
        self.assertEqual(struct.unpack(">II", (folder / "cells.png").read_bytes()[16:24]), (1430, 1100))

    def test_what_is_missing_is_told_in_one_line(self):
        outcome = self.draw(FOLDER / "missing.cairn", "-o", FOLDER / "none.png")
        self.assertEqual(outcome.returncode, 1)
        self.assertEqual(outcome.stderr, f"example_levels.py: error: cannot open {FOLDER}/missing.cairn/index.bin: "
                                         "No such file or directory\n")


class Readme(SurveyCase):
    def test_its_example_runs(self):
        text = (SOURCE / "README.md").read_text(encoding="utf-8")
        section = text.partition("\n### Python\n")[2].partition("\n### ")[0]
        code = section.partition("```python\n")[2].partition("```")[0]
        self.assertIn("import cairn", code)
        copy_of(self.path, "site")
        outcome = subprocess.run([sys.executable, "-"], input=code, cwd=FOLDER, capture_output=True, text=True, check=False)
        self.assertEqual((outcome.returncode, outcome.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
