// Decodes chunks of LAZ files for one cairn process, which talks to it over the socket that is its
// standard input and output. Both sides speak in turn, numbers are little-endian:
//
//   worker, once     u32 0                      ready
//   cairn            u32 chunk bytes, u32 points, u16 record bytes, u8 point format, u8 0; the chunk
//   worker           u32 n > 0, n LAS records   again and again until all points are sent
//                    u32 0                      the chunk was sound to its end
//   worker, instead  u32 0xffffffff, u32 length, that many bytes of text: it failed, and ends
//
// It ends when cairn closes the socket. LAZ is decoded by laz-perf, compiled to WebAssembly: whatever
// a damaged chunk does stays inside this process.
'use strict';

const fs = require('fs');
const path = require('path');

const SOCKET_IN = 0;
const SOCKET_OUT = 1;
const REQUEST_BYTES = 12;
const BLOCK_BYTES = 256 * 1024;
const READY = 0;
const DONE = 0;
const FAILED = 0xffffffff;
// Zeros behind a chunk, for a decoder that runs over the end of a damaged one.
const GUARD_BYTES = 64 * 1024;
// Where the object behind laz-perf's ChunkDecoder keeps its place in the chunk.
const PLACE_OFFSET = 24;

/** Reads exactly `length` bytes; false if the socket was closed. */
function readFully(target, offset, length) {
  while (length > 0) {
    const got = fs.readSync(SOCKET_IN, target, offset, length, null);
    if (got === 0) return false;
    offset += got;
    length -= got;
  }
  return true;
}

function writeFully(source, offset, length) {
  while (length > 0) {
    const put = fs.writeSync(SOCKET_OUT, source, offset, length, null);
    offset += put;
    length -= put;
  }
}

function sendNumbers(...numbers) {
  const bytes = Buffer.alloc(4 * numbers.length);
  numbers.forEach((number, i) => bytes.writeUInt32LE(number, 4 * i));
  writeFully(bytes, 0, bytes.length);
}

function fail(error) {
  const told = error instanceof Error ? error.message : 'laz-perf threw an exception';
  const text = Buffer.from(told.split('\n')[0]);
  sendNumbers(FAILED, text.length);
  writeFully(text, 0, text.length);
  process.exit(1);
}

/**
 * The module laz-perf, and its method getPoint without the checks and conversions of every argument
 * that the binding makes at every call: they take as long as decoding a third of a point. The compiled
 * function behind the method is noted while the module registers it.
 */
async function loadLazPerf() {
  const folder = path.dirname(require.resolve('laz-perf'));
  let getPointCall;
  let functions;
  const module = await require('laz-perf').createLazPerf({
    instantiateWasm(imports, receive) {
      const register = imports.env._embind_register_class_function;
      // Two classes have a getPoint; the one of ChunkDecoder is registered last.
      imports.env._embind_register_class_function = (...registration) => {
        getPointCall = registration;
        return register(...registration);
      };
      const wasm = new WebAssembly.Module(fs.readFileSync(path.join(folder, 'laz-perf.wasm')));
      const instance = new WebAssembly.Instance(wasm, imports);
      functions = instance.exports.__indirect_function_table;
      receive(instance, wasm);
      return instance.exports;
    },
  });
  const [, , , , , invoker, context] = getPointCall;
  const invoke = functions.get(invoker);
  return { module, getPoint: (decoder, to) => invoke(context, decoder, to) };
}

class ChunkReader {
  constructor({ module, getPoint }) {
    this.module = module;
    this.getPoint = getPoint;
    this.pristine = module.HEAPU8.slice();
  }

  /**
   * Makes the module's memory what it was at first. A decoder that runs over an end in a damaged chunk
   * then reads the same bytes whatever was decoded before, so results never depend on which worker
   * does what.
   */
  reset() {
    this.module.HEAPU8.set(this.pristine);
    this.module.HEAPU8.fill(0, this.pristine.length);
  }

  allocate(size) {
    const at = this.module._malloc(size);
    if (at === 0) throw new Error(`no memory for ${size} bytes`);
    return at;
  }

  /** Reads a chunk from the socket, sends its points. False if the socket was closed. */
  serve(request) {
    this.reset();
    const { chunkBytes } = request;
    const chunk = this.allocate(chunkBytes + GUARD_BYTES);
    if (!readFully(this.module.HEAPU8, chunk, chunkBytes)) return false;
    const decoder = new this.module.ChunkDecoder();
    decoder.open(request.pointFormat, request.recordBytes, chunk);
    if (this.place(decoder) !== chunk) throw new Error('laz-perf is not of the version expected');
    this.sendPoints(decoder.$$.ptr, request);
    const used = this.place(decoder) - chunk;
    if (used !== chunkBytes)
      throw new Error(`damaged: its points take ${used} bytes of ${chunkBytes}`);
    decoder.delete();
    sendNumbers(DONE);
    return true;
  }

  place(decoder) {
    const words = this.module.HEAPU32;
    return words[(words[decoder.$$.ptr >> 2] + PLACE_OFFSET) >> 2];
  }

  sendPoints(decoder, { points, recordBytes }) {
    const { getPoint } = this;
    const most = Math.max(1, Math.floor(BLOCK_BYTES / recordBytes));
    const out = this.allocate(4 + most * recordBytes);
    for (let done = 0; done < points; ) {
      const count = Math.min(most, points - done);
      for (let i = 0, to = out + 4; i < count; i += 1, to += recordBytes) getPoint(decoder, to);
      this.module.HEAPU32[out >> 2] = count;
      writeFully(this.module.HEAPU8, out, 4 + count * recordBytes);
      done += count;
    }
  }
}

async function main() {
  const reader = new ChunkReader(await loadLazPerf());
  const head = Buffer.alloc(REQUEST_BYTES);
  sendNumbers(READY);
  while (
    readFully(head, 0, REQUEST_BYTES) &&
    reader.serve({
      chunkBytes: head.readUInt32LE(0),
      points: head.readUInt32LE(4),
      recordBytes: head.readUInt16LE(8),
      pointFormat: head.readUInt8(10),
    })
  );
}

main().catch(fail);
