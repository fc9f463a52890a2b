// The grid of a field technique, read from its NRRD so that the transfer function editor has a histogram to stand on.

import { call } from './api.js';

const BINS = 256;
const TYPES = { uint8: Uint8Array, int16: Int16Array, uint16: Uint16Array, float: Float32Array };

/** The subject of the editor (see Volumes.subject) for the field of a render that has begun. */
export async function fieldSubject(renderId) {
  const response = await call(`v1/renders/${renderId}/field`, { accept: 'application/octet-stream' });
  return { ...histogramOf(await response.arrayBuffer()), kind: 'density' };
}

/** Range, counts and mean side of a raw little-endian NRRD, the only kind that the server writes. */
export function histogramOf(buffer) {
  const bytes = new Uint8Array(buffer);
  const end = bytes.findIndex((byte, i) => byte === 10 && bytes[i + 1] === 10);
  const header = new TextDecoder().decode(bytes.subarray(0, end));
  const entry = (name) => new RegExp(`^${name}:=?\\s*(.*)$`, 'm').exec(header)?.[1] ?? '';
  const sizes = entry('sizes').split(/\s+/).map(Number);
  const axes = [...entry('space directions').matchAll(/\(([^)]*)\)/g)].map(([, axis]) => Math.hypot(...axis.split(',').map(Number)));
  const values = new TYPES[entry('type')](buffer.slice(end + 2)); // a copy: the data need not be aligned
  const [slope, inter] = [Number(entry('slope')) || 1, Number(entry('intercept')) || 0];
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  const counts = Array(BINS).fill(0);
  const perBin = BINS / (high - low || 1);
  for (const value of values) if (Number.isFinite(value)) counts[Math.min(BINS - 1, Math.floor((value - low) * perBin))] += 1;
  return {
    range: [low * slope + inter, high * slope + inter],
    counts,
    meanSide: axes.reduce((sum, side, i) => sum + side * sizes[i], 0) / axes.length,
  };
}
