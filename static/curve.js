// The mathematics of a transfer function: its curve, its axes, its colours. No DOM.

const toSrgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const toLinear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

/** Linear sRGB 0..1 -> "#rrggbb", the form of a colour input. */
export const hexOf = (color) => `#${color
  .map((x) => Math.round(255 * toSrgb(Math.max(0, Math.min(1, x)))).toString(16).padStart(2, '0')).join('')}`;

export const colorOf = (hex) => [1, 3, 5]
  .map((at) => Number(toLinear(parseInt(hex.slice(at, at + 2), 16) / 255).toFixed(4)));

/** The curve at a value: linear between points, constant beyond the ends. */
export function sample(points, value) {
  const above = points.findIndex((point) => point.value >= value);
  if (above === 0) return points[0];
  if (above < 0) return points[points.length - 1];
  const [a, b] = [points[above - 1], points[above]];
  const t = b.value > a.value ? (value - a.value) / (b.value - a.value) : 1;
  return {
    value,
    color: a.color.map((x, i) => x + t * (b.color[i] - x)),
    opacity_per_unit: a.opacity_per_unit + t * (b.opacity_per_unit - a.opacity_per_unit),
  };
}

/** A number as short as it can be said: three figures. */
export const brief = (x) => {
  if (x === 0) return '0';
  const size = Math.abs(x);
  return size >= 1e5 || size < 1e-3 ? x.toExponential(1) : String(Number(x.toPrecision(3)));
};

const DENSE_OPTICAL_DEPTH = 40; // across the volume's mean side: as good as solid

/** The top of the opacity axis: 1, 2 or 5 times a power of ten, above all points and where the volume looks solid. */
export function opacityTop(points, meanSide) {
  const wanted = Math.max(DENSE_OPTICAL_DEPTH / meanSide, 1.2 * Math.max(0, ...points.map((point) => point.opacity_per_unit)));
  const decade = 10 ** Math.floor(Math.log10(wanted));
  return [1, 2, 5, 10].map((step) => step * decade).find((top) => top >= wanted * 0.999) ?? 10 * decade;
}

/** Opacity per unit <-> height 0..1: linear near 0, decades above, three of them in view. */
export function opacityAxis(top) {
  const knee = top / 300;
  const whole = Math.log1p(top / knee);
  return {
    top,
    heightOf: (opacity) => Math.log1p(Math.max(0, opacity) / knee) / whole,
    opacityOf: (height) => knee * Math.expm1(Math.max(0, Math.min(1, height)) * whole),
    ticks: [0.01, 0.1, 1].map((part) => part * top),
  };
}

/** The same points with values that rise by at least `gap`, as the server wants them. */
export function rising(points, gap) {
  const sorted = [...points].sort((a, b) => a.value - b.value);
  sorted.forEach((point, i) => {
    if (i > 0 && point.value - sorted[i - 1].value < gap) sorted[i] = { ...point, value: sorted[i - 1].value + gap };
  });
  return sorted;
}
