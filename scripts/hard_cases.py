#!/usr/bin/env python3
"""Prints what became of the hard cases of tests/hard_cases/: a page of two tables, in Markdown.

    scripts/hard_cases.py [build/release/hard_cases_tests] > hard_cases.md

Runs the tests, which takes a minute or two. Exits with 1 if a promise is broken.
"""
import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

CLOUDS = """\
# Hard cases

## Clouds that are hard on numbers

"holds" means: the same bytes with one thread and little memory as with several threads, all promises verified against
the input, and what a formula expects.

| case | points | levels | nodes | points a node | step | rms of the root | bound of the root | |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |"""

TROUBLE = """
## Trouble

What made other converters lose points without a word, crash or hang: damaged files, degenerate clouds, disks and kills.
They are PotreeConverter 2 (c2328c4) and nxsbuild of Nexus (2bc3739), which we ran on files of the same kind. "holds"
means that Cairn answered as told, that a dataset it made was verified against its input and has equal nodes, and that
after a refusal there was nothing new, and an earlier dataset as it had been.

| trouble | the others | Cairn | |
| --- | --- | --- | --- |"""


def run(tests):
    """All results of the test program, one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder, "results.json")
        subprocess.run([tests, f"--gtest_output=json:{results}"], stdout=subprocess.DEVNULL, check=False)
        suites = json.loads(results.read_text())["testsuites"]
    return [test for suite in suites for test in suite["testsuite"]]


def verdict(test):
    if "failures" in test:
        return "BROKEN"
    return "skipped" if test["result"] == "SKIPPED" else "holds"


def number(text):
    return f"{float(text):.4g}" if text else ""


def words(test):
    """The name of a test that tells no other: NothingIsLost is "nothing is lost"."""
    return re.sub(r"[A-Z]", lambda letter: " " + letter[0].lower(), test["name"]).strip()


def cloud_cells(test):
    name = test.get("case") or words(test)
    cells = [test.get(key, "") for key in ("points", "levels", "nodes", "node_points")]
    return [name, *cells, *(number(test.get(key, "")) for key in ("step", "rms", "bound"))]


def trouble_cells(test):
    return [test.get("trouble") or words(test), test.get("others", ""), test.get("answer", "")]


def print_table(head, tests, cells):
    print(head)
    for test in tests:
        print("| " + " | ".join([*cells(test), verdict(test)]) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tests", nargs="?", default="build/release/hard_cases_tests")
    results = run(parser.parse_args().tests)
    # Tables of cases first, then single ones.
    results.sort(key=lambda test: "/" not in test["name"])
    print_table(CLOUDS, [test for test in results if "Trouble" not in test["classname"]], cloud_cells)
    print_table(TROUBLE, [test for test in results if "Trouble" in test["classname"]], trouble_cells)
    sys.exit(any("failures" in test for test in results))


if __name__ == "__main__":
    main()
