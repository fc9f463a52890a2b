// How the transfer function editor looks: the histogram, the axes, the curve and the points, as SVG.
// It keeps where things are on the page; what they are stays with transfer.js.

import { brief, hexOf, sample } from './curve.js';

const HEIGHT_PX = 150;
const MARGIN = { left: 8, right: 8, top: 8, bottom: 18 };
const SEGMENTS = 96; // of the drawn curve, which is straight in opacity but not on this axis
const POINT_RADIUS_PX = 6;

const svg = (tag, attributes = {}, text = '') => {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text) element.textContent = text;
  return element;
};
const label = (x, y, text, anchor) => svg('text', { x, y, 'text-anchor': anchor }, text);

export class TransferView {
  /** @param {SVGElement} element @param {(index: number) => void} focused a point */
  constructor(element, focused) {
    this.svg = element;
    this.focused = focused;
    this.bars = svg('path', { class: 'bars' });
    this.grid = svg('g', { class: 'grid' });
    this.gradient = svg('linearGradient', { id: 'transfer-gradient' });
    this.area = svg('path', { class: 'area', fill: 'url(#transfer-gradient)' });
    this.line = svg('path', { class: 'line' });
    this.points = svg('g');
    element.append(this.bars, this.gradient, this.area, this.grid, this.line, this.points);
  }

  // ---- where things are

  get #box() {
    const width = this.svg.clientWidth || 300;
    return { width, across: width - MARGIN.left - MARGIN.right, up: HEIGHT_PX - MARGIN.top - MARGIN.bottom };
  }

  x(value) {
    const [low, high] = this.state.domain;
    return MARGIN.left + ((value - low) / (high - low)) * this.#box.across;
  }

  y(opacity) {
    return MARGIN.top + (1 - this.state.axis.heightOf(opacity)) * this.#box.up;
  }

  /** The value and opacity under a pointer. */
  where(event) {
    const at = this.svg.getBoundingClientRect();
    const { across, up } = this.#box;
    const [low, high] = this.state.domain;
    const t = Math.max(0, Math.min(1, (event.clientX - at.left - MARGIN.left) / across));
    return {
      value: low + t * (high - low),
      opacity: this.state.axis.opacityOf(1 - (event.clientY - at.top - MARGIN.top) / up),
    };
  }

  /** Whether two places are too near each other to be told apart. */
  touching(a, b) {
    return Math.hypot(this.x(a.value) - this.x(b.value), this.y(a.opacity) - this.y(b.opacity)) < POINT_RADIUS_PX;
  }

  focus(index) {
    this.points.children[index]?.focus();
  }

  // ---- drawing

  /** @param {{points, selected: number, axis, domain: number[], volume: {range: number[], counts: number[]|null}}} state */
  draw(state) {
    this.state = state;
    const { points, axis, domain: [low, high] } = state;
    const { width, across, up } = this.#box;
    const floor = MARGIN.top + up;
    const right = MARGIN.left + across;
    this.svg.setAttribute('viewBox', `0 0 ${width} ${HEIGHT_PX}`);
    this.bars.setAttribute('d', this.#bars(floor, up));
    this.grid.replaceChildren(
      ...axis.ticks.flatMap((opacity) => [
        svg('line', { x1: MARGIN.left, x2: right, y1: this.y(opacity), y2: this.y(opacity) }),
        label(MARGIN.left + 2, this.y(opacity) + 10, brief(opacity), 'start'),
      ]),
      label(MARGIN.left, HEIGHT_PX - 4, brief(low), 'start'),
      label(MARGIN.left + across / 2, HEIGHT_PX - 4, 'opacity per unit, by value', 'middle'),
      label(right, HEIGHT_PX - 4, brief(high), 'end'),
    );
    const along = Array.from({ length: SEGMENTS + 1 }, (_, i) => low + (i / SEGMENTS) * (high - low));
    const path = [...along, ...points.map((point) => point.value)].sort((a, b) => a - b)
      .map((value) => `${this.x(value).toFixed(1)},${this.y(sample(points, value).opacity_per_unit).toFixed(1)}`).join('L');
    this.line.setAttribute('d', `M${path}`);
    this.area.setAttribute('d', `M${MARGIN.left},${floor}L${path}L${right},${floor}Z`);
    this.gradient.replaceChildren(...along.filter((_, i) => i % 4 === 0).map((value) => svg('stop', {
      offset: (value - low) / (high - low), 'stop-color': hexOf(sample(points, value).color),
    })));
    this.#drawPoints();
  }

  #bars(floor, up) {
    const { counts, range: [low, high] } = this.state.volume;
    if (!counts) return '';
    // By the second largest: one bin of air holds more than all others and would flatten them.
    const most = Math.log1p(Math.max(1, [...counts].sort((a, b) => b - a)[1]));
    const edge = (i) => this.x(low + (i / counts.length) * (high - low)).toFixed(1);
    const top = (count) => (floor - Math.min(1, Math.log1p(count) / most) * up).toFixed(1);
    return `M${edge(0)},${floor}${counts.map((count, i) => `V${top(count)}H${edge(i + 1)}`).join('')}V${floor}Z`;
  }

  /** Circles are kept from one drawing to the next, so that a focused point keeps the focus. */
  #drawPoints() {
    const { points, selected, domain: [low, high] } = this.state;
    while (this.points.children.length > points.length) this.points.lastChild.remove();
    points.forEach((point, index) => {
      if (!this.points.children[index]) {
        const circle = svg('circle', { r: POINT_RADIUS_PX, tabindex: 0, role: 'slider', 'data-index': index });
        circle.addEventListener('focus', () => this.focused(index));
        this.points.append(circle);
      }
      const attributes = {
        cx: this.x(point.value).toFixed(1),
        cy: this.y(point.opacity_per_unit).toFixed(1),
        fill: hexOf(point.color),
        class: index === selected ? 'selected' : '',
        'aria-label': `Point ${index + 1} of ${points.length}`,
        'aria-valuenow': point.value,
        'aria-valuemin': low,
        'aria-valuemax': high,
        'aria-valuetext': `value ${brief(point.value)}, opacity ${brief(point.opacity_per_unit)} per unit`,
      };
      for (const [name, value] of Object.entries(attributes)) this.points.children[index].setAttribute(name, value);
    });
  }
}
