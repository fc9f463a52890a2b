// The transfer function editor: points over the histogram, by mouse, finger or keyboard.
// Across: voxel value. Up: opacity per world unit, on a scale that is linear near 0 and decades above.

import { colorOf, hexOf, opacityAxis, opacityTop, rising, sample } from './curve.js';
import { objectControls } from './controls.js';
import { presetPoints, suitingPreset } from './presets.js';
import { TransferView } from './transfer-view.js';
import { make } from './widgets.js';

const CUSTOM = 'custom';
const AUTOMATIC = '';
const LEAST_POINTS = 2;
const GAP = 1e-4; // between the values of two points, of the axis' length

export class TransferEditor {
  points = [];
  selected = 0;
  volume = { range: [0, 1], counts: null, meanSide: 2, kind: 'density' };
  #drag = false;
  #extras = null;

  constructor(changed) {
    this.changed = changed;
    this.svg = document.getElementById('transfer');
    this.preset = document.getElementById('preset');
    this.extras = document.getElementById('transfer-extras');
    this.view = new TransferView(this.svg, (index) => {
      this.selected = index;
      this.#draw();
    });
    this.#buildRow();
    this.preset.addEventListener('change', () => this.#choose());
    this.svg.addEventListener('pointerdown', (event) => this.#grab(event));
    this.svg.addEventListener('pointermove', (event) => this.#pull(event));
    for (const end of ['pointerup', 'pointercancel']) this.svg.addEventListener(end, () => this.#letGo());
    this.svg.addEventListener('dblclick', (event) => this.#add(this.view.where(event)));
    this.svg.addEventListener('keydown', (event) => this.#key(event));
    new ResizeObserver(() => this.#draw()).observe(this.svg);
  }

  /**
   * Another technique: the presets that it offers, the one it starts with (none: what suits the volume), what `hls`
   * takes besides, and the JSON pointer for the server's complaints. What has been chosen stays chosen.
   */
  setPresets({ names, initial = AUTOMATIC, extras, root, pointer }) {
    this.svg.dataset.pointer = pointer;
    this.preset.dataset.pointer = `${pointer}/preset`;
    const before = this.preset.value;
    const offered = [...(initial === AUTOMATIC ? [AUTOMATIC] : []), ...names, CUSTOM];
    this.preset.replaceChildren(...offered.map((name) => make('option', { value: name, textContent: name.replaceAll('_', ' ') })));
    this.preset.value = before !== AUTOMATIC && offered.includes(before) ? before : initial;
    this.#extras = extras && objectControls(extras, {
      root, pointer, skip: ['preset', 'points'], changed: () => this.#choose(),
    });
    this.#refill();
  }

  /** Another volume under the curve. Own points move along with the range of values. */
  setVolume(volume) {
    const { range: [low, high], meanSide } = this.volume;
    const [newLow, newHigh] = volume.range;
    const move = (value) => newLow + ((value - low) / (high - low || 1)) * (newHigh - newLow);
    if (this.preset.value === CUSTOM) {
      this.points = this.points.map((point) => ({
        ...point,
        value: Number(move(point.value).toPrecision(4)),
        opacity_per_unit: Number(((point.opacity_per_unit * meanSide) / volume.meanSide).toPrecision(4)),
      }));
    }
    this.volume = volume;
    this.#refill();
  }

  /** The same volume, computed anew: points stay where they are. */
  setHistogram({ range, counts }) {
    this.volume = { ...this.volume, range, counts };
    this.#rescale();
  }

  get custom() {
    return this.preset.value === CUSTOM;
  }

  /** The value for the request; undefined where the server is to choose. */
  read() {
    if (this.custom) return { points: this.points };
    if (this.preset.value === AUTOMATIC) return undefined;
    return { preset: this.preset.value, ...this.#ownOfPreset() };
  }

  /** The preset in force, also where the server chooses. */
  get #name() {
    return this.preset.value || suitingPreset(this.volume.kind);
  }

  #ownOfPreset() {
    return this.#name === 'hls' ? this.#extras?.read() ?? {} : {};
  }

  #choose() {
    this.#refill();
    this.changed();
  }

  #refill() {
    const automatic = this.preset.querySelector('option[value=""]');
    if (automatic) automatic.textContent = `auto (${suitingPreset(this.volume.kind).replaceAll('_', ' ')})`;
    this.extras.replaceChildren(...(!this.custom && this.#name === 'hls' && this.#extras ? [this.#extras.element] : []));
    if (!this.custom) this.points = presetPoints(this.#name, this.volume, this.#ownOfPreset());
    this.selected = Math.min(this.selected, this.points.length - 1);
    this.#rescale();
  }

  #edited() {
    this.preset.value = CUSTOM;
    this.extras.replaceChildren();
    const point = this.points[this.selected];
    this.points = rising(this.points, this.#gap);
    if (point) this.selected = Math.max(0, this.points.findIndex((other) => other === point || other.value === point.value));
    if (!this.#drag) this.#rescale();
    this.#draw();
    this.changed();
  }

  get #gap() {
    return (this.domain[1] - this.domain[0]) * GAP;
  }

  #rescale() {
    this.axis = opacityAxis(opacityTop(this.points, this.volume.meanSide));
    const values = this.points.map((point) => point.value);
    this.domain = [Math.min(this.volume.range[0], ...values), Math.max(this.volume.range[1], ...values)];
    if (this.domain[0] === this.domain[1]) this.domain[1] += 1;
    this.#draw();
  }

  // ---- editing

  #place(index, value, opacity) {
    const before = this.points[index - 1];
    const after = this.points[index + 1];
    const low = before ? before.value + this.#gap : this.domain[0];
    const high = after ? after.value - this.#gap : this.domain[1];
    this.points[index] = {
      ...this.points[index],
      value: Math.max(low, Math.min(high, Number(value.toPrecision(4)))),
      opacity_per_unit: Number(Math.max(0, opacity).toPrecision(4)),
    };
  }

  #add({ value, opacity }) {
    if (this.points.some((point) => this.view.touching({ value, opacity }, { value: point.value, opacity: point.opacity_per_unit }))) return;
    const index = this.points.filter((point) => point.value < value).length;
    this.points.splice(index, 0, { value, color: sample(this.points, value).color.map((x) => Number(x.toFixed(4))), opacity_per_unit: opacity });
    this.#place(index, value, opacity);
    this.selected = index;
    this.#edited();
    this.view.focus(this.selected);
  }

  /** Halfway to the next point: what the keyboard has for a double-click. */
  #addBeside() {
    const from = Math.min(this.selected, this.points.length - 2);
    const value = (this.points[Math.max(0, from)].value + (this.points[from + 1]?.value ?? this.domain[1])) / 2;
    this.#add({ value, opacity: sample(this.points, value).opacity_per_unit });
  }

  #remove() {
    if (this.points.length <= LEAST_POINTS) return;
    this.points.splice(this.selected, 1);
    this.selected = Math.min(this.selected, this.points.length - 1);
    this.#edited();
    this.view.focus(this.selected);
  }

  #grab(event) {
    const point = event.target.closest('[data-index]');
    if (!point || event.button !== 0) return;
    this.selected = Number(point.dataset.index);
    this.#drag = true;
    this.svg.setPointerCapture(event.pointerId);
    this.view.focus(this.selected);
    this.#draw();
    event.preventDefault();
  }

  #pull(event) {
    if (!this.#drag) return;
    const { value, opacity } = this.view.where(event);
    this.#place(this.selected, value, opacity < this.axis.top / 3000 ? 0 : opacity);
    this.#edited();
  }

  #letGo() {
    if (!this.#drag) return;
    this.#drag = false;
    this.#rescale();
  }

  #key(event) {
    const point = event.target.closest('[data-index]');
    if (!point) return;
    this.selected = Number(point.dataset.index);
    const { value, opacity_per_unit: opacity } = this.points[this.selected];
    const sideways = (this.domain[1] - this.domain[0]) * (event.shiftKey ? 0.05 : 0.01);
    const upwards = event.shiftKey ? 0.1 : 0.02;
    const height = this.axis.heightOf(opacity);
    const keys = {
      ArrowLeft: () => this.#place(this.selected, value - sideways, opacity),
      ArrowRight: () => this.#place(this.selected, value + sideways, opacity),
      ArrowUp: () => this.#place(this.selected, value, this.axis.opacityOf(height + upwards)),
      ArrowDown: () => this.#place(this.selected, value, height <= upwards ? 0 : this.axis.opacityOf(height - upwards)),
    };
    if (keys[event.key]) {
      keys[event.key]();
      this.#edited();
    } else if (event.key === 'Delete' || event.key === 'Backspace') this.#remove();
    else if (event.key === 'Insert') this.#addBeside();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  // ---- drawing

  #buildRow() {
    const row = document.getElementById('transfer-point');
    const number = (label) => make('input', { type: 'number', step: 'any', ariaLabel: label, title: label });
    this.row = {
      value: number('Value of the point'),
      opacity: number('Opacity per unit of the point'),
      color: make('input', { type: 'color', ariaLabel: 'Colour of the point', title: 'Colour' }),
      add: make('button', { type: 'button', textContent: '+', title: 'Add a point (Insert)', ariaLabel: 'Add a point' }),
      remove: make('button', { type: 'button', textContent: '−', title: 'Remove the point (Delete)', ariaLabel: 'Remove the point' }),
    };
    this.row.opacity.min = 0;
    row.append(...Object.values(this.row));
    const typed = () => {
      const value = Number(this.row.value.value);
      const opacity = Number(this.row.opacity.value);
      if (!Number.isFinite(value) || !Number.isFinite(opacity)) return;
      this.points[this.selected] = { ...this.points[this.selected], value, opacity_per_unit: opacity };
      this.#edited();
    };
    this.row.value.addEventListener('change', typed);
    this.row.opacity.addEventListener('change', typed);
    this.row.color.addEventListener('input', () => {
      this.points[this.selected] = { ...this.points[this.selected], color: colorOf(this.row.color.value) };
      this.#edited();
    });
    this.row.add.addEventListener('click', () => this.#addBeside());
    this.row.remove.addEventListener('click', () => this.#remove());
  }

  #draw() {
    if (!this.axis || this.points.length === 0) return;
    this.view.draw(this);
    this.#drawRow();
  }

  #drawRow() {
    const point = this.points[this.selected];
    if (!point) return;
    this.row.value.value = point.value;
    this.row.opacity.value = point.opacity_per_unit;
    this.row.color.value = hexOf(point.color);
    this.row.remove.disabled = this.points.length <= LEAST_POINTS;
  }
}
