// The server's transfer function presets as points, so that they can be seen over the histogram and an edit can start
// from them. The same numbers as src/scene/presets.rs, which is what renders; no DOM.

import { colorOf } from './curve.js';

const OPTICAL_DEPTH = 24; // of a preset's opacity 1 across the volume's mean side
const HLS_POINTS = 24;

/** [place, sRGB, opacity]; places are fractions of the range of values. */
const RAMP = [[0, '#1a1a80', 0], [0.5, '#e08040', 0.5], [1, '#fff8e0', 1]];
const MRI_HEAD = [
  [0, '#000000', 0], [0.13, '#5a2e22', 0], [0.22, '#b0694a', 0.4], [0.34, '#c98f70', 0.64],
  [0.5, '#d8b49a', 1.6], [0.65, '#f0dcc8', 4], [1, '#ffffff', 8],
];
const CT_BONE = [
  [0, '#000000', 0], [0.3, '#6a2a1c', 0], [0.42, '#a8583c', 0.06], [0.55, '#d8b890', 0.9], [0.75, '#f4ead2', 3], [1, '#ffffff', 6],
];
/** Places in Hounsfield units. */
const CT_BONE_HOUNSFIELD = [
  [-1000, '#000000', 0], [120, '#6a2a1c', 0], [220, '#b07850', 0.2], [450, '#e0c8a0', 1.5], [1000, '#f6eedc', 4], [2000, '#ffffff', 6],
];

const BONE_FLESH = [
  [0, '#000000', 0], [0.18, '#c07860', 0], [0.22, '#d08870', 0.12], [0.4, '#d08870', 0.12], [0.46, '#f6eedc', 5], [1, '#ffffff', 8],
];
/** Places in Hounsfield units. */
const BONE_FLESH_HOUNSFIELD = [
  [-1000, '#000000', 0], [-200, '#c07860', 0], [-50, '#d08870', 0.12], [150, '#d08870', 0.12], [250, '#f6eedc', 5], [2000, '#ffffff', 8],
];
const BLUE_YELLOW = [
  [0, '#2040ff', 0], [0.12, '#2040ff', 0], [0.16, '#2040ff', 0.2], [0.44, '#2040ff', 0.2], [0.5, '#ffe020', 8], [1, '#ffe020', 8],
];

/** Amounts below 0 are blue and those above red. */
const SIGNED = [
  [0, '#2166ac', 1], [0.25, '#67a9cf', 0.4], [0.45, '#d1e5f0', 0], [0.55, '#fddbc7', 0], [0.75, '#ef8a62', 0.4], [1, '#b2182b', 1],
];

/** The preset that the server takes for each kind of values where a request names none. */
const SUITING = { density: 'ramp', hounsfield: 'ct_bone', labels: 'labels', signed_map: 'signed', intensity: 'mri_head' };

export function suitingPreset(kind) {
  return SUITING[kind] ?? 'ramp';
}

/**
 * @param {string} name
 * @param {{range: [number, number], window?: [number, number], kind?: string, meanSide: number}} volume
 * @param {{rotation?: number, exponent?: number}} own what the preset takes besides
 */
export function presetPoints(name, { range, window = range, kind, meanSide }, { rotation = 0, exponent = 2 } = {}) {
  const most = Math.max(...window.map(Math.abs));
  const [low, high] = name === 'signed' ? [-most, most] : window;
  const full = OPTICAL_DEPTH / meanSide;
  const point = (value, color, opacity) => ({
    value: Number(value.toPrecision(4)), color, opacity_per_unit: Number((opacity * full).toPrecision(4)),
  });
  if (name === 'hls') {
    return Array.from({ length: HLS_POINTS + 1 }, (_, i) => i / HLS_POINTS)
      .map((v) => point(v * (high > 0 ? high : 1), colorOf(hue(v + rotation)), v ** exponent));
  }
  const absolute = { ct_bone: CT_BONE_HOUNSFIELD, bone_flesh: BONE_FLESH_HOUNSFIELD }[name];
  if (absolute && kind === 'hounsfield') {
    return absolute.map(([value, color, opacity]) => point(value, colorOf(color), opacity));
  }
  const shape = { mri_head: MRI_HEAD, ct_bone: CT_BONE, bone_flesh: BONE_FLESH, blue_yellow: BLUE_YELLOW, signed: SIGNED }[name] ?? RAMP;
  return shape.map(([place, color, opacity]) => point(low + (high - low || 1) * place, colorOf(color), opacity));
}

/** The pure hue of a turn, as "#rrggbb". */
function hue(turn) {
  return `#${[0, -1 / 3, -2 / 3].map((shift) => {
    const t = ((((turn + shift) % 1) + 1) % 1) * 6;
    return Math.round(255 * Math.max(0, Math.min(1, Math.abs(t - 3) - 1))).toString(16).padStart(2, '0');
  }).join('')}`;
}
