// The leaf controls: each is `{element, focusable, read(), write(value)}` over one resolved schema.
// `read` gives undefined for "nothing said"; `changed` is called when the user has changed the value.

import { colorOf, hexOf } from './curve.js';
import { optionsOf, rangeOf, vectorItems } from './schema.js';

const SLIDER_STEPS = 400;
const COLOUR_NAMES = /colou?r|background|albedo|tint/i; // three numbers of such a name are linear sRGB

/** The values of the volume that is shown: the range of sliders whose schema says `x-slider: values`. */
const volumeValues = { low: 0, high: 1 };

export function showValues([low, high]) {
  Object.assign(volumeValues, { low, high: high > low ? high : low + 1 });
  document.dispatchEvent(new Event('volumevalues'));
}

export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  const { dataset, ...rest } = properties;
  Object.assign(element, rest);
  Object.assign(element.dataset, dataset);
  element.append(...children.filter((child) => child !== null));
  return element;
}

/** A slider's travel: even steps, decades where the range spans them, finer near 0 where it starts there. */
function travel({ low, high }) {
  if (low > 0 && high / low >= 100) {
    return { at: (value) => Math.log(value / low) / Math.log(high / low), value: (t) => low * (high / low) ** t };
  }
  const power = low === 0 && high >= 50 ? 3 : 1;
  return {
    at: (value) => ((value - low) / (high - low)) ** (1 / power),
    value: (t) => low + (high - low) * t ** power,
  };
}

export function numberWidget(schema, { id, pointer, changed }) {
  const integer = schema.type === 'integer';
  const box = make('input', {
    type: 'number', id, step: integer ? '1' : 'any', inputMode: integer ? 'numeric' : 'decimal',
    placeholder: schema.default === undefined || schema.default === null ? 'automatic' : '', dataset: { pointer },
  });
  const low = schema.minimum ?? schema.exclusiveMinimum;
  const high = schema.maximum ?? schema.exclusiveMaximum;
  if (Number.isFinite(low)) box.min = low;
  if (Number.isFinite(high)) box.max = high;
  const range = schema['x-slider'] === 'values' ? volumeValues : rangeOf(schema);
  const slider = range && make('input', {
    type: 'range', min: 0, max: SLIDER_STEPS, step: 1, tabIndex: -1, ariaHidden: 'true',
  });

  const place = () => {
    if (!slider) return;
    const value = box.value === '' ? range.low : Number(box.value);
    slider.value = Math.round(SLIDER_STEPS * travel(range).at(Math.max(range.low, Math.min(range.high, value))));
    slider.classList.toggle('unset', box.value === '');
  };
  box.addEventListener('input', place);
  box.addEventListener('change', changed);
  if (schema['x-slider']) document.addEventListener('volumevalues', place);
  slider?.addEventListener('input', () => {
    const slide = travel(range);
    let value = slide.value(slider.value / SLIDER_STEPS);
    const digits = range.high - range.low > 20 || integer ? 3 : 4;
    value = integer ? Math.round(value) : Number(value.toPrecision(digits));
    if (value <= range.low && schema.exclusiveMinimum !== undefined) value = Number(slide.value(1 / SLIDER_STEPS).toPrecision(3));
    if (value >= range.high && schema.exclusiveMaximum !== undefined) {
      value = Number(slide.value((SLIDER_STEPS - 1) / SLIDER_STEPS).toPrecision(3));
    }
    box.value = Math.max(range.low, Math.min(range.high, value));
    slider.classList.remove('unset');
    changed();
  });
  return {
    focusable: box,
    aside: slider,
    element: box,
    read: () => (box.value === '' ? undefined : Number(box.value)),
    write(value) {
      box.value = value ?? '';
      place();
    },
  };
}

export function booleanWidget(schema, { id, pointer, changed }) {
  const box = make('input', { type: 'checkbox', id, dataset: { pointer } });
  box.addEventListener('change', changed);
  return {
    focusable: box, element: box, read: () => box.checked, write(value) { box.checked = value === true; },
  };
}

const spoken = (value) => ({ true: 'yes', false: 'no' }[value] ?? String(value).replaceAll('_', ' '));

export function choiceWidget(schema, { id, pointer, changed, required }) {
  const options = optionsOf(schema);
  const select = make('select', { id, dataset: { pointer } });
  const open = schema.nullable || (!required && (schema.default === undefined || schema.default === null));
  if (open) select.append(make('option', { value: '', textContent: 'automatic' }));
  options.forEach(({ value, description }, index) => select.append(make('option', {
    value: String(index), textContent: spoken(value), title: description ?? '',
  })));
  select.addEventListener('change', changed);
  return {
    focusable: select,
    element: select,
    read: () => (select.value === '' ? undefined : options[Number(select.value)].value),
    write(value) {
      const index = options.findIndex((option) => option.value === value);
      select.value = index < 0 ? (open ? '' : '0') : String(index);
    },
  };
}

export function stringWidget(schema, { id, pointer, changed }) {
  const box = make('input', { type: 'text', id, spellcheck: false, dataset: { pointer } });
  box.addEventListener('change', changed);
  return {
    focusable: box, element: box, read: () => box.value || undefined, write(value) { box.value = value ?? ''; },
  };
}

export function vectorWidget(schema, { id, pointer, changed, root, name }) {
  const items = vectorItems(schema, root);
  const boxes = items.map((item, index) => make('input', {
    type: 'number', step: item.type === 'integer' ? '1' : 'any', id: index === 0 ? id : `${id}-${index}`,
    ariaLabel: `${name} ${items.length <= 4 ? 'xyzw'[index] : index + 1}`, dataset: { pointer: `${pointer}/${index}` },
  }));
  const read = () => (boxes.some((box) => box.value === '') ? undefined : boxes.map((box) => Number(box.value)));
  const picker = boxes.length === 3 && COLOUR_NAMES.test(name) ? make('input', { type: 'color', ariaLabel: `${name}, chosen by eye` }) : null;
  const show = () => { if (picker) picker.value = hexOf(read() ?? [0, 0, 0]); };
  const write = (value) => {
    boxes.forEach((box, index) => { box.value = value?.[index] ?? ''; });
    show();
  };
  boxes.forEach((box) => box.addEventListener('change', () => {
    show();
    changed();
  }));
  picker?.addEventListener('input', () => {
    write(colorOf(picker.value));
    changed();
  });
  return {
    focusable: boxes[0],
    wide: true,
    element: make('div', { className: 'vector', role: 'group', ariaLabel: name, dataset: { pointer } }, ...boxes, picker),
    read,
    write,
  };
}

/** For every shape that has no control of its own. */
export function jsonWidget(schema, { id, pointer, changed }) {
  const box = make('textarea', { id, rows: 3, spellcheck: false, placeholder: 'JSON', dataset: { pointer } });
  const parse = () => JSON.parse(box.value);
  let last;
  box.addEventListener('change', () => {
    try {
      last = box.value.trim() === '' ? undefined : parse();
      box.setCustomValidity('');
      box.removeAttribute('aria-invalid');
      changed();
    } catch (error) {
      box.setCustomValidity(`This is not JSON: ${error.message}`);
      box.setAttribute('aria-invalid', 'true');
      box.reportValidity();
    }
  });
  return {
    focusable: box,
    wide: true,
    element: box,
    read: () => last,
    write(value) {
      last = value ?? undefined;
      box.value = last === undefined ? '' : JSON.stringify(last);
    },
  };
}
