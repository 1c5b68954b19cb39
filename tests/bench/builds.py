"""What the benchmarks of whole builds share: scans from a generator, builds that are timed, medians with their spread."""

import contextlib
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "build/release/cairn"


def add_arguments(parser, points=None):
    if points is not None:
        parser.add_argument("--points", type=int, default=points)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--program", type=pathlib.Path, default=PROGRAM)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the scans and datasets, kept afterwards")


@contextlib.contextmanager
def workplace(keep):
    """The folder for scans and datasets: `keep`, which stays, or one that is removed at the end. A program that fails in it
    ends this one with a line that names it."""
    folder = keep or pathlib.Path(tempfile.mkdtemp(prefix="cairn-bench-"))
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield folder
    except subprocess.CalledProcessError as error:
        sys.exit(f"{error.cmd[0]} ended with exit code {error.returncode}")
    finally:
        if not keep:
            shutil.rmtree(folder, ignore_errors=True)


def generate(generator, points, kind, folder):
    """The scan that a generator, the C++ source of a `gen_scan N PREFIX KIND`, makes: kept from an earlier call, or made."""
    scan = folder / f"bench-{points}.{kind}"
    if not scan.exists():
        binary = folder / "gen_scan"
        subprocess.run(["g++", "-O2", "-o", binary, generator], check=True)
        part = folder / f"part-{points}"
        subprocess.run([binary, str(points), part.as_posix(), kind], check=True)
        part.with_suffix(f".{kind}").rename(scan)  # none is taken for whole that an interruption cut
    return scan


class MemoryGroup:
    """A memory control group (version 1), as a context: processes in it have so many bytes, with the cache of the files
    that they are the first to read or write."""

    folder = pathlib.Path("/sys/fs/cgroup/memory/cairn-bench")

    def __init__(self, limit_bytes):
        self.limit_bytes = limit_bytes

    def __enter__(self):
        try:
            self.folder.mkdir(exist_ok=True)
            (self.folder / "memory.limit_in_bytes").write_text(str(self.limit_bytes))
        except OSError as error:
            sys.exit(f"memory control groups of version 1, and root, are needed: {error}")
        return self

    def __exit__(self, *_):
        (self.folder / "memory.force_empty").write_text("0")
        self.folder.rmdir()

    def enter_process(self):
        (self.folder / "cgroup.procs").write_text(str(os.getpid()))


def build(program, scan, output, threads, flags=(), group=None):
    """Builds once. What the program records in run.json, and the wall time of the whole process beside it."""
    command = [program, "build", scan, "-o", output, "--force", "--progress", "none", "--threads", str(threads), *flags]
    start = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, preexec_fn=group.enter_process if group else None)
    wall = time.monotonic() - start
    record = json.loads((output / "run.json").read_text())
    record["wall_s"] = wall
    return record


def forget(path):
    """Has the kernel drop what it holds of a file, so that the next to read it reads the disk."""
    with open(path, "rb") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def spread(values, digits):
    median, least, most = (f"{value:.{digits}f}" for value in (statistics.median(values), min(values), max(values)))
    return f"{median} ({least} to {most})"
