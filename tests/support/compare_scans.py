#!/usr/bin/env python3
"""Tells whether an exported PLY or text holds the points of a PLY, PCD, PTX or text scan, as multisets.

A second parser of these formats, for tests alone: it shares no code with the readers that it is held against and
knows just enough of each format. Positions of the scan are rounded to the dataset's grid, whose steps and offsets
are given; those that lie on the grid must come back as they were, others within half a step. All attributes must
come back equal. Points without a position (a coordinate that is no number, an empty cell of a PTX grid) are left out.

usage: compare_scans.py SCAN EXPORTED STEP_X STEP_Y STEP_Z OFFSET_X OFFSET_Y OFFSET_Z
"""
import math
import re
import struct
import sys
from collections import Counter

PLY_TYPES = {
    'char': 'b', 'int8': 'b', 'uchar': 'B', 'uint8': 'B', 'short': 'h', 'int16': 'h', 'ushort': 'H',
    'uint16': 'H', 'int': 'i', 'int32': 'i', 'uint': 'I', 'uint32': 'I', 'float': 'f', 'float32': 'f',
    'double': 'd', 'float64': 'd'}
PCD_TYPES = {
    'F4': 'f', 'F8': 'd', 'I1': 'b', 'I2': 'h', 'I4': 'i', 'I8': 'q', 'U1': 'B', 'U2': 'H', 'U4': 'I', 'U8': 'Q'}
# Other names of what an exported file names in one way.
COMMON_NAMES = {'scalar_intensity': 'intensity', 'normal_x': 'nx', 'normal_y': 'ny', 'normal_z': 'nz'}


def number_of(word, code):
    """A word of a text as the type `code`, rounded as that type rounds."""
    if code not in 'fd':
        return int(word)
    return struct.unpack('<' + code, struct.pack('<' + code, float(word)))[0]


def read_ply(data):
    """Names, types and rows of the first element, which is that of the points."""
    head, _, body = data.partition(b'end_header')
    body = body[body.index(b'\n') + 1:]
    words = [line.split() for line in head.decode('ascii', 'replace').splitlines()]
    encoding = next(line[1] for line in words if line[:1] == ['format'])
    elements = [i for i, line in enumerate(words) if line[:1] == ['element']] + [len(words)]
    assert words[elements[0]][1] == 'vertex'
    count = int(words[elements[0]][2])
    properties = [line for line in words[elements[0]:elements[1]] if line[:1] == ['property']]
    names = [line[2] for line in properties]
    types = [PLY_TYPES[line[1]] for line in properties]
    if encoding == 'ascii':
        lines = body.decode('ascii', 'replace').splitlines()[:count]
        rows = [tuple(map(number_of, line.split(), types)) for line in lines]
    else:
        row = struct.Struct(('<' if encoding == 'binary_little_endian' else '>') + ''.join(types))
        rows = list(row.iter_unpack(body[:count * row.size]))
    assert len(rows) == count
    return names, types, rows


def decompress_lzf(data, size):
    """LZF: a byte below 32 begins that many literals and one more, any other a copy of what was written."""
    out = bytearray()
    at = 0
    while at < len(data):
        control = data[at]
        at += 1
        if control < 32:
            out += data[at:at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += data[at]
            at += 1
        distance = ((control & 31) << 8 | data[at]) + 1
        at += 1
        for _ in range(length + 2):
            out.append(out[-distance])
    assert len(out) == size
    return bytes(out)


def read_pcd(data):
    head = {}
    at = 0
    while 'DATA' not in head:
        end = data.index(b'\n', at)
        words = data[at:end].decode('ascii').split()
        head[words[0] if words else ''] = words[1:]
        at = end + 1
    names = [name.lower() for name in head['FIELDS']]
    types = [PCD_TYPES[kind + size] for kind, size in zip(head['TYPE'], head['SIZE'])]
    assert set(head.get('COUNT', ['1'])) == {'1'}
    count = int(head['POINTS'][0])
    encoding = head['DATA'][0]
    if encoding == 'ascii':
        lines = data[at:].decode('ascii').splitlines()[:count]
        rows = [tuple(map(number_of, line.split(), types)) for line in lines]
    elif encoding == 'binary':
        row = struct.Struct('<' + ''.join(types))
        rows = list(row.iter_unpack(data[at:at + count * row.size]))
    else:  # column by column
        packed, size = struct.unpack_from('<II', data, at)
        plain = decompress_lzf(data[at + 8:at + 8 + packed], size)
        columns, at = [], 0
        for code in types:
            columns.append(struct.unpack_from(f'<{count}{code}', plain, at))
            at += count * struct.calcsize('<' + code)
        rows = list(zip(*columns))
    assert len(rows) == count
    return unpack_color(names, types, rows)


def unpack_color(names, types, rows):
    """The field `rgb`: 32 bits, if need be behind a float, blue lowest."""
    if 'rgb' not in names:
        return names, types, rows
    at = names.index('rgb')
    as_bytes = struct.Struct('<' + types[at])
    rows = [row[:at] + tuple(as_bytes.pack(row[at])[2::-1]) + row[at + 1:] for row in rows]
    return (names[:at] + ['red', 'green', 'blue'] + names[at + 1:],
            types[:at] + ['B', 'B', 'B'] + types[at + 1:], rows)


def names_of_columns(suffix, width):
    color = ['red', 'green', 'blue']
    if suffix == 'xyz':
        return ['x', 'y', 'z'] + (color if width > 3 else []) + [f'column_{i}' for i in range(7, width + 1)]
    return ['x', 'y', 'z', 'intensity', *color][:width]


def read_text(data, suffix):
    separator = ',' if suffix == 'csv' else None
    text = data.decode('ascii').splitlines()
    lines = [line.split(separator) for line in text if not line.startswith('#')]
    names = lines.pop(0) if lines[0][0].isalpha() else None
    rows = [tuple(map(float, line)) for line in lines if len(line) > 1]  # one word: a number of points
    return names or names_of_columns(suffix, len(rows[0])), ['d'] * len(rows[0]), rows


def read_ptx(data):
    lines = [tuple(map(float, line.split())) for line in data.decode('ascii').splitlines() if line.strip()]
    points = []
    at = 0
    while at < len(lines):
        cells = int(lines[at][0]) * int(lines[at + 1][0])
        matrix = lines[at + 6:at + 10]
        rows = lines[at + 10:at + 10 + cells]
        at += 10 + cells
        for row in rows:
            if row[:3] == (0, 0, 0):
                continue
            x, y, z = row[:3]
            world = tuple(x * matrix[0][c] + y * matrix[1][c] + z * matrix[2][c] + matrix[3][c] for c in range(3))
            points.append(world + row[3:])
    return names_of_columns('ptx', len(points[0])), ['d'] * len(points[0]), points


def read_scan(path):
    with open(path, 'rb') as file:
        data = file.read()
    suffix = path.rpartition('.')[2]
    if suffix == 'ply':
        return read_ply(data)
    if suffix == 'pcd':
        return read_pcd(data)
    return read_ptx(data) if suffix == 'ptx' else read_text(data, suffix)


def nearest_step(value, step, offset):
    """Halves away from zero: of two steps that are equally near, the program takes this one."""
    steps = (value - offset) / step
    return int(math.copysign(math.floor(abs(steps) + 0.5), steps))


class Grid:
    def __init__(self, steps, offsets):
        self.axes = list(zip(steps, offsets))

    def of(self, position):
        return tuple(nearest_step(v, *axis) for v, axis in zip(position, self.axes))

    def holds(self, position):
        """Decimal steps have no exact products: there the nearest doubles to both are as good."""
        slack = 0 if self.is_binary() else 1e-15
        return all(abs(p - offset - step * i) <= slack * (abs(p) + abs(offset))
                   if slack else p == offset + step * i
                   for p, i, (step, offset) in zip(position, self.of(position), self.axes))

    def is_binary(self):
        return all(math.frexp(step)[0] == 0.5 for step, _ in self.axes)


def comparable(value):
    return 'nan' if value != value else value


def multiset(names, rows, columns, types, grid):
    """Counts of rows: the position in grid steps, then `columns` as `types`. And the finite positions themselves."""
    places = [names.index(axis) for axis in 'xyz']
    order = [names.index(name) for name in columns]
    counts = Counter()
    positions = []
    for row in rows:
        position = tuple(row[place] for place in places)
        if not all(map(math.isfinite, position)):
            continue
        positions.append(position)
        values = tuple(comparable(number_of(row[i], code)) for i, code in zip(order, types))
        counts[grid.of(position) + values] += 1
    return counts, positions


def compare(scan, exported, grid):
    names, _, rows = scan
    names = [COMMON_NAMES.get(name, re.sub(r'[^a-z0-9]+', '_', name.lower())) for name in names]
    back_names, back_types, back_rows = exported
    assert back_names[:3] == ['x', 'y', 'z']
    columns = back_names[3:]
    assert sorted(names) == sorted(back_names), f'{names} became {back_names}'
    expected, positions = multiset(names, rows, columns, back_types[3:], grid)
    found, back_positions = multiset(back_names, back_rows, columns, back_types[3:], grid)
    assert sum(found.values()) == len(back_rows)
    missing = expected - found
    lost = next(iter(missing), None)
    assert expected == found, f'{missing.total()} of {len(positions)} points are lost, so {lost}'
    off_grid = [p for p in back_positions if not grid.holds(p)]
    assert not off_grid, f'{len(off_grid)} exported points are between two steps, so {off_grid[0]}'
    # A step is a power of two that fits the extent into 30 bits, or the scan's own.
    extent = max(max(values) - min(values) for values in zip(*positions))
    steps = [step for step, _ in grid.axes]
    fine = max(steps) <= extent / 2**29 or not grid.is_binary()
    assert extent == 0 or fine, f'steps of {steps} for an extent of {extent}'
    return len(positions)


def main():
    numbers = list(map(float, sys.argv[3:9]))
    print(compare(read_scan(sys.argv[1]), read_scan(sys.argv[2]), Grid(numbers[:3], numbers[3:])))


main()
