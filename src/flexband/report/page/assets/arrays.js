// Arrays that packed() of arrays.py has written: {shape, bytes, data, quantum?}.
"use strict";
window.flexband = window.flexband || {};

/** Return {shape, values: Float64Array} of a packed array. */
flexband.unpacked = async function (packed) {
  const text = atob(packed.data);
  const raw = Uint8Array.from(text, (c) => c.charCodeAt(0));
  const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const size = packed.bytes, count = planes.length / size;
  const bytes = new Uint8Array(planes.length);
  for (let p = 0; p < size; p++) {
    for (let k = 0; k < count; k++) bytes[k * size + p] = planes[p * count + k];
  }
  const kinds = { 2: Int16Array, 4: Int32Array, 8: Float64Array };
  let values = new kinds[size](bytes.buffer);
  if (packed.quantum) values = Float64Array.from(values, (v) => v * packed.quantum);
  return { shape: packed.shape, values };
};

/** Return a tree of objects and lists with every packed array in it unpacked. */
flexband.unpackedTree = async function (tree) {
  if (tree === null || typeof tree !== "object") return tree;
  if (typeof tree.data === "string" && Array.isArray(tree.shape)) return flexband.unpacked(tree);
  if (Array.isArray(tree)) return Promise.all(tree.map(flexband.unpackedTree));
  const own = await Promise.all(Object.values(tree).map(flexband.unpackedTree));
  return Object.fromEntries(Object.keys(tree).map((name, k) => [name, own[k]]));
};
