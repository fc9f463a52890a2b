// Builds the controls of a technique from its JSON Schema. A control is `{element, read(forced)}`;
// what is as the server would have it is left out of the request unless `forced` by a shape that needs it.

import { equal, kindOf, resolve, variantName, words } from './schema.js';
import {
  booleanWidget, choiceWidget, jsonWidget, make, numberWidget, stringWidget, vectorWidget,
} from './widgets.js';

const LEAVES = {
  number: numberWidget,
  boolean: booleanWidget,
  choice: choiceWidget,
  string: stringWidget,
  vector: vectorWidget,
  json: jsonWidget,
};

const MOST_NESTING = 6; // a schema that refers to itself ends as a JSON box

let nextId = 0;

/**
 * The controls of all properties of an object schema.
 * @param {object} schema an object schema
 * @param {{root: object, pointer: string, example?: object, skip?: string[], changed(): void, depth?: number}} at
 * @returns {{element: HTMLElement, read(forced?: boolean): object|undefined}}
 */
export function objectControls(schema, at) {
  const { example = {}, skip = [], depth = 0 } = at;
  const required = new Set(schema.required ?? []);
  const element = make('div', { className: 'fields' });
  const members = Object.entries(schema.properties ?? {})
    .filter(([name]) => !skip.includes(name))
    .map(([name, property]) => {
      const control = propertyControl(name, resolve(property, at.root), {
        ...at, pointer: `${at.pointer}/${name}`, example: example?.[name] ?? undefined, required: required.has(name), skip: [], depth,
      });
      if (control.element) element.append(control.element);
      return [name, control];
    });
  return {
    element,
    empty: members.length === 0,
    read(forced = false) {
      const said = members
        .map(([name, control]) => [name, control.read(forced && required.has(name))])
        .filter(([, value]) => value !== undefined);
      return said.length > 0 || forced ? Object.fromEntries(said) : undefined;
    },
  };
}

function propertyControl(name, schema, at) {
  const kind = at.depth > MOST_NESTING ? 'json' : kindOf(schema, at.root);
  if (kind === 'constant') return { element: null, read: (forced) => (forced || at.required ? schema.const : undefined) };
  if (kind === 'object') return group(name, schema, at);
  if (kind === 'variants') return variants(name, schema, at);
  return leaf(name, kind, schema, at);
}

function group(name, schema, at) {
  if (schema.nullable || (!at.required && !('default' in schema) && (schema.required?.length ?? 0) > 0)) {
    return variants(name, { ...schema, nullable: true, variants: [schema] }, at);
  }
  const start = at.required ? at.example : undefined;
  const inner = objectControls(withDefaults(schema, schema.default), { ...at, example: start, depth: at.depth + 1 });
  return {
    element: make('fieldset', { dataset: { pointer: at.pointer } }, legend(name, schema), inner.element),
    read: (forced) => inner.read(forced || at.required),
  };
}

/** Puts an object's own default into its properties, where each control looks for it. */
function withDefaults(schema, value) {
  if (typeof value !== 'object' || value === null) return schema;
  const properties = Object.fromEntries(Object.entries(schema.properties)
    .map(([name, property]) => [name, name in value ? { ...property, default: value[name] } : property]));
  return { ...schema, properties };
}

function legend(name, schema) {
  const element = make('legend', { textContent: words(name) });
  if (schema.description) element.title = schema.description;
  return element;
}

/** One of several shapes: a select, and the controls of the shape that it names. */
function variants(name, schema, at) {
  const id = `control-${nextId += 1}`;
  const shapes = schema.variants;
  const open = !at.required;
  const select = make('select', { id, dataset: { pointer: at.pointer } });
  if (open) select.append(make('option', { value: '', textContent: 'automatic' }));
  const single = shapes.length === 1;
  shapes.forEach((shape, index) => select.append(make('option', {
    value: String(index), textContent: single ? 'set' : variantName(shape).replaceAll('_', ' '), title: shape.description ?? '',
  })));
  const body = make('div');
  const built = new Map();
  const current = () => (select.value === '' ? null : Number(select.value));

  const inside = (index) => {
    if (!built.has(index)) {
      const shape = shapes[index];
      const start = at.example ?? schema.default ?? undefined;
      const value = matches(shape, start) ? start : undefined;
      const kind = kindOf(shape, at.root);
      built.set(index, kind === 'object'
        ? objectControls(withDefaults(shape, value), { ...at, example: value, depth: at.depth + 1 })
        : propertyControl('value', { ...shape, default: undefined }, { ...at, example: value, required: true, depth: at.depth + 1 }));
    }
    return built.get(index);
  };
  const show = () => {
    const index = current();
    body.replaceChildren(...(index === null ? [] : [inside(index).element].filter(Boolean)));
  };
  const first = shapes.findIndex((shape) => matches(shape, at.example));
  if (at.required) select.value = String(Math.max(0, first));
  select.addEventListener('change', () => {
    show();
    at.changed();
  });
  show();
  const row = make('label', { className: 'row', htmlFor: id }, make('span', { textContent: words(name) }), select);
  if (schema.description) row.title = schema.description;
  return {
    element: make('fieldset', { className: 'variants' }, row, body),
    read: () => (current() === null ? undefined : inside(current()).read(true)),
  };
}

const matches = (shape, value) => (typeof value === 'object' && value !== null
  ? (shape.required ?? []).every((name) => name in value
    && (shape.properties?.[name]?.const === undefined || shape.properties[name].const === value[name]))
    && Object.keys(value).every((name) => name in (shape.properties ?? {}))
  : 'const' in shape && shape.const === value);

function leaf(name, kind, schema, at) {
  const id = `control-${nextId += 1}`;
  const start = schema.default ?? (at.required ? at.example ?? schema.minimum ?? 0 : undefined);
  const reset = make('button', {
    type: 'button', className: 'reset', title: 'Back to the default', ariaLabel: `${words(name)}: back to the default`, textContent: '↺', hidden: true,
  });
  const changed = () => {
    reset.hidden = equal(widget.read(), start);
    at.changed();
  };
  const undecided = kind === 'boolean' && schema.default == null && !at.required;
  const widget = undecided
    ? choiceWidget({ ...schema, options: [{ value: true }, { value: false }] }, { id, pointer: at.pointer, changed })
    : LEAVES[kind](schema, { id, pointer: at.pointer, changed, root: at.root, name: words(name), required: at.required });
  widget.write(start);
  reset.addEventListener('click', () => {
    widget.write(start);
    widget.focusable.focus();
    changed();
  });
  const label = make('label', { htmlFor: id, textContent: words(name) });
  const element = make('div', { className: `field ${kind}${widget.wide ? ' wide' : ''}` },
    label, reset, widget.element, widget.aside ?? null);
  if (schema.description) {
    const hint = make('p', { className: 'hint', id: `${id}-hint`, textContent: schema.description });
    widget.focusable.setAttribute('aria-describedby', hint.id);
    element.append(hint);
  }
  return {
    element,
    read(forced) {
      const value = widget.read();
      if (value === undefined) return undefined;
      return !forced && schema.default !== undefined && equal(value, schema.default) ? undefined : value;
    },
  };
}
