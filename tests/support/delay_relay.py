#!/usr/bin/env python3
"""Passes TCP connections on as a long line would: every byte comes later, both ways, and all together no faster than a rate.

    delay_relay.py PORT TARGET_HOST:PORT [--round-trip-ms 50] [--bytes-per-second N]

Listens on 127.0.0.1 (port 0: any; the one chosen is the first line on stdout). Half of the round trip is spent on each way.
A connection begins with a round trip, as a handshake takes. With a rate, what the target sends is cut into packets
that leave one after the other, whatever connection they belong to. The kernel's netem would do the same; not every kernel has it.
"""
import argparse
import asyncio
import collections
import time

PACKET = 1448  # bytes of a packet of Ethernet that TCP fills


class Line:
    """What all connections share: when the next packet may leave."""

    def __init__(self, bytes_per_second):
        self.bytes_per_second = bytes_per_second
        self.free_at = 0.0

    def leaves_at(self, size):
        now = time.monotonic()
        if not self.bytes_per_second:
            return now
        self.free_at = max(self.free_at, now) + size / self.bytes_per_second
        return self.free_at


async def carry(reader, writer, delay, line):
    """Brings all that comes from `reader` to `writer`, each packet `delay` seconds after it left."""
    packets, more = collections.deque(), asyncio.Event()

    async def take():
        while data := await reader.read(PACKET if line else 65536):
            leaves = line.leaves_at(len(data)) if line else time.monotonic()
            packets.append((leaves + delay, data))
            more.set()
            # A sender learns by full buffers how fast it may be: not much more than the line holds waits here.
            while line and packets and packets[-1][0] > time.monotonic() + delay + 0.2:
                await asyncio.sleep(0.01)
        packets.append((time.monotonic() + delay, b""))
        more.set()

    taking = asyncio.ensure_future(take())
    try:
        while True:
            while not packets:
                more.clear()
                await more.wait()
            due, data = packets.popleft()
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            if not data:
                break
            writer.write(data)
            await writer.drain()
        writer.write_eof()
    except (ConnectionError, OSError):
        pass
    finally:
        taking.cancel()


async def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("port", type=int)
    parser.add_argument("target")
    parser.add_argument("--round-trip-ms", type=float, default=50)
    parser.add_argument("--bytes-per-second", type=float, default=0)
    options = parser.parse_args()
    host, port = options.target.rsplit(":", 1)
    one_way = options.round_trip_ms / 2000
    line = Line(options.bytes_per_second)

    async def serve(reader, writer):
        try:
            far_reader, far_writer = await asyncio.open_connection(host, int(port))
        except OSError:
            writer.close()
            return
        await asyncio.sleep(2 * one_way)  # the handshake
        await asyncio.gather(carry(reader, far_writer, one_way, None), carry(far_reader, writer, one_way, line),
                             return_exceptions=True)
        for end in (writer, far_writer):
            end.close()

    server = await asyncio.start_server(serve, "127.0.0.1", options.port)
    print(server.sockets[0].getsockname()[1], flush=True)
    async with server:
        await server.serve_forever()


asyncio.run(main())
