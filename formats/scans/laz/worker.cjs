// Decodes chunks of LAZ files for one cairn process, which talks to it over the socket that is its
// standard input and output. Both sides speak in turn, numbers are little-endian:
//
//   worker, once     u32 0                      ready
//   cairn            u32 chunk bytes, u32 points, u16 record bytes, u8 point format, u8 0; the chunk
//   worker           u32 n > 0, n LAS records   again and again until all points are sent
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
const FAILED = 0xffffffff;
// Behind a chunk: what a decoder reads that runs over the end of a damaged one.
const GUARD_BYTES = 64 * 1024;

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
  const text = Buffer.from(String((error && error.message) || error).split('\n')[0]);
  sendNumbers(FAILED, text.length);
  writeFully(text, 0, text.length);
  process.exit(1);
}

/**
 * laz-perf, and its method getPoint without the checks and conversions of every argument that the
 * binding makes at every call: they take as long as decoding a third of a point. The compiled
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
  return { module, getPoint: (decoder, to) => invoke(context, decoder.$$.ptr, to) };
}

/** Memory of the module that is asked for anew only when it is too small. */
class HeapBuffer {
  constructor(module) {
    this.module = module;
    this.at = 0;
    this.size = 0;
  }

  ensure(size) {
    if (size <= this.size) return this.at;
    if (this.at !== 0) this.module._free(this.at);
    this.size = 0;
    this.at = this.module._malloc(size);
    if (this.at === 0) throw new Error(`no memory for ${size} bytes`);
    this.size = size;
    return this.at;
  }
}

function decode(lazPerf, buffers, request) {
  const { module, getPoint } = lazPerf;
  const { points, recordBytes, pointFormat } = request;
  const decoder = new module.ChunkDecoder();
  decoder.open(pointFormat, recordBytes, buffers.chunk.at);
  const most = Math.max(1, Math.floor(BLOCK_BYTES / recordBytes));
  const out = buffers.records.ensure(4 + most * recordBytes);
  for (let done = 0; done < points; ) {
    const count = Math.min(most, points - done);
    for (let i = 0, to = out + 4; i < count; i += 1, to += recordBytes) getPoint(decoder, to);
    module.HEAPU32[out >> 2] = count;
    writeFully(module.HEAPU8, out, 4 + count * recordBytes);
    done += count;
  }
  decoder.delete();
}

async function main() {
  const lazPerf = await loadLazPerf();
  const { module } = lazPerf;
  const buffers = { chunk: new HeapBuffer(module), records: new HeapBuffer(module) };
  const header = Buffer.alloc(REQUEST_BYTES);
  sendNumbers(READY);
  while (readFully(header, 0, REQUEST_BYTES)) {
    const chunkBytes = header.readUInt32LE(0);
    const at = buffers.chunk.ensure(chunkBytes + GUARD_BYTES);
    if (!readFully(module.HEAPU8, at, chunkBytes)) return;
    module.HEAPU8.fill(0, at + chunkBytes, at + chunkBytes + GUARD_BYTES);
    decode(lazPerf, buffers, {
      points: header.readUInt32LE(4),
      recordBytes: header.readUInt16LE(8),
      pointFormat: header.readUInt8(10),
    });
  }
}

main().catch(fail);
