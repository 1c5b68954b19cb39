// Decodes a LAZ file to LAS by laz-perf's reader of whole files, for tests: it finds the chunks by itself, where
// the program's own reader walks the table and hands chunk after chunk to workers.
//
//   node laz_to_las.cjs FOLDER_OF_LAZ_PERF SCAN.laz RESULT.las
'use strict';

const fs = require('fs');

const POINT_DATA_OFFSET_AT = 96;
const POINT_FORMAT_AT = 104;
const POINT_FORMAT_BITS = 0x3f; // the others mark LAZ

async function main([lazPerf, scan, result]) {
  const module = await require(lazPerf).createLazPerf();
  const packed = fs.readFileSync(scan);
  const data = module._malloc(packed.length);
  module.HEAPU8.set(packed, data);
  const laz = new module.LASZip();
  laz.open(data, packed.length);
  const size = laz.getPointLength();
  const point = module._malloc(size);
  const headers = packed.subarray(0, packed.readUInt32LE(POINT_DATA_OFFSET_AT));
  headers[POINT_FORMAT_AT] &= POINT_FORMAT_BITS;
  const records = Buffer.alloc(laz.getCount() * size);
  for (let at = 0; at < records.length; at += size) {
    laz.getPoint(point);
    records.set(module.HEAPU8.subarray(point, point + size), at);
  }
  fs.writeFileSync(result, Buffer.concat([headers, records]));
}

main(process.argv.slice(2)).catch((error) => {
  console.error(error);
  process.exit(1);
});
