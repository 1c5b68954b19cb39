#!/usr/bin/env python3
"""Counts what the index of a dataset tells of its nodes, level by level, as JSON.

Written after formats/FORMAT.md alone: it shares no code with the program whose figures are held against it.

usage: count_nodes.py DATASET.cairn
"""
import json
import os
import struct
import sys

HEAD_BYTES = 200
FIXED_RECORD_BYTES = 168
SECTION_BYTES = 24
FIXED_SECTIONS = 4


def read_attribute_names(data, count):
    names = []
    at = HEAD_BYTES
    for _ in range(count):
        length = data[at + 3]
        names.append(data[at + 4:at + 4 + length].decode('ascii'))
        at += 4 + length
    return names


def read_record(data, at, fanout, sections):
    level, = struct.unpack_from('<I', data, at + 28)
    points, = struct.unpack_from('<I', data, at + 56)
    weight, = struct.unpack_from('<Q', data, at + 88)
    theta, = struct.unpack_from('<f', data, at + 108)
    rms, bound = struct.unpack_from('<dd', data, at + 112)
    grid, = struct.unpack_from('<I', data, at + 128)
    first_section = at + FIXED_RECORD_BYTES + (4 * (fanout + 1) + 7) // 8 * 8
    sizes = [struct.unpack_from('<I', data, first_section + SECTION_BYTES * s + 8)[0] for s in range(sections)]
    return {'level': level, 'points': points, 'weight': weight, 'theta': theta, 'rms': rms, 'bound': bound,
            'grid': grid, 'sizes': sizes}


def read_nodes(data):
    head_bytes, = struct.unpack_from('<I', data, 12)
    nodes, record_bytes, page_records = struct.unpack_from('<QII', data, 56)
    fanout, = struct.unpack_from('<I', data, 184)
    attributes, = struct.unpack_from('<I', data, 196)
    names = ['position', 'representative', 'weight', 'radius', *read_attribute_names(data, attributes)]
    pages = -(-nodes // page_records)
    start = head_bytes + 8 * pages
    assert start + nodes * record_bytes == len(data)
    return names, [read_record(data, start + i * record_bytes, fanout, FIXED_SECTIONS + attributes)
                   for i in range(nodes)]


def spread(values):
    ordered = sorted(values)
    return {'min': ordered[0], 'median': ordered[(len(ordered) - 1) // 2], 'max': ordered[-1]}


def count_level(names, nodes):
    points = [node['points'] for node in nodes]
    mean = sum(points) / len(points)
    return {
        'nodes': len(nodes),
        'points': sum(points),
        'weight': sum(node['weight'] for node in nodes),
        'min': min(points),
        'mean': mean,
        'max': max(points),
        'variation': (sum((p - mean)**2 for p in points) / len(points))**0.5 / mean,
        'sizes': sorted([size, points.count(size)] for size in set(points)),
        'theta': spread(node['theta'] for node in nodes),
        'grid': spread(node['grid'] for node in nodes),
        'node_rms': spread(node['rms'] for node in nodes),
        'node_bound': spread(node['bound'] for node in nodes),
        'section_bytes': {name: sum(node['sizes'][s] for node in nodes) for s, name in enumerate(names)},
    }


def main():
    with open(os.path.join(sys.argv[1], 'index.bin'), 'rb') as file:
        names, nodes = read_nodes(file.read())
    levels = range(max(node['level'] for node in nodes) + 1)
    print(json.dumps([count_level(names, [n for n in nodes if n['level'] == level]) for level in levels]))


main()
