#!/usr/bin/env python3
"""Prints the table of hard cases with their results, in Markdown.

    scripts/hard_cases.py [build/release/hard_cases_tests] > hard_cases.md

Each case is a cloud that is hard on numbers, see tests/hard_cases/. "holds" means: the same bytes with one thread and
little memory as with several threads, all promises verified against the input, and what a formula expects.
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path


def run(tests):
    """All results of the test program, by suite."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder, "results.json")
        subprocess.run([tests, f"--gtest_output=json:{results}"], stdout=subprocess.DEVNULL, check=False)
        return json.loads(results.read_text())["testsuites"]


def number(text):
    return f"{float(text):.4g}" if text else ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tests", nargs="?", default="build/release/hard_cases_tests")
    arguments = parser.parse_args()
    failed = False
    print("| case | points | levels | nodes | points a node | step | rms of the root | bound of the root | |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |")
    for suite in run(arguments.tests):
        for test in suite["testsuite"]:
            failed |= "failures" in test
            name = test.get("case") or test["name"].split("/")[-1].replace("_", " ")
            cells = [test.get(key, "") for key in ("points", "levels", "nodes", "node_points")]
            cells += [number(test.get(key, "")) for key in ("step", "rms", "bound")]
            print("| " + " | ".join([name, *cells, "BROKEN" if "failures" in test else "holds"]) + " |")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
