#!/usr/bin/env python3
"""Fails on an include against the arrows of the design.

    scripts/check_includes.py [root]

pipeline/ may include all floors, stages/ and viewer/ only formats/ and themselves, formats/ only
itself. Inside stages/ no stage includes another: a stage is a subfolder (stages/split/) or a header
with its source directly in stages/ (stages/pack.h, stages/pack.cpp); the other headers directly in
stages/, and those named in SHARED, are there for all stages.
"""
import re
import sys
from pathlib import Path

MAY_INCLUDE = {
    "formats": {"formats"},
    "stages": {"formats", "stages"},
    "viewer": {"formats", "viewer"},
    "pipeline": {"formats", "stages", "viewer", "pipeline"},
}
SHARED = {"context", "neighbors", "node_path", "parallel"}
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"')


def stage_of(root: Path, file: Path):
    """The stage that a file under stages/ belongs to; None for what all stages share."""
    parts = file.parts[1:]
    name = parts[0] if len(parts) > 1 else file.stem
    is_stage = len(parts) > 1 or (root / file).with_suffix(".cpp").exists() or file.suffix == ".cpp"
    return name if is_stage and name not in SHARED else None


def fault(root: Path, source: Path, included: Path):
    """Why `source` may not include `included`, or None if it may."""
    floor, other = source.parts[0], included.parts[0]
    if not (root / included).is_file():
        return "is not the path of a file from the project's root"
    if other not in MAY_INCLUDE[floor]:
        allowed = ", ".join(sorted(MAY_INCLUDE[floor]))
        return f"goes against the arrows: {floor}/ may include only {allowed}"
    if floor == other == "stages":
        mine, theirs = stage_of(root, source), stage_of(root, included)
        if theirs not in (mine, None):
            return f"joins two stages: {mine or 'what stages share'} and {theirs}"
    return None


def main() -> int:
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent)
    faults = checked = 0
    for floor in MAY_INCLUDE:
        for path in sorted((root / floor).rglob("*.[ch]*")):
            if path.suffix not in (".h", ".cpp"):
                continue
            checked += 1
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
                match = INCLUDE.match(line)
                source = path.relative_to(root)
                reason = match and fault(root, source, Path(match[1]))
                if reason:
                    print(f'{source}:{number}: "{match[1]}" {reason}', file=sys.stderr)
                    faults += 1
    print(f"{checked} files, {faults} includes against the arrows")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
