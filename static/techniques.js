// The technique to look with: its select, its words, its controls and the transfer function where it has one.

import { objectControls } from './controls.js';
import { resolve } from './schema.js';
import { make } from './widgets.js';

const DEFAULT_TECHNIQUE = 'emission_absorption';
const TRANSFER = 'transfer_function';

export class Techniques {
  #controls = new Map();

  /** @param {TransferEditor} transfer @param {() => void} changed */
  constructor(transfer, changed) {
    this.transfer = transfer;
    this.changed = changed;
    this.select = document.getElementById('technique');
    this.planned = document.getElementById('planned');
    this.planned.addEventListener('change', changed);
    this.select.addEventListener('change', () => {
      this.#show();
      changed();
    });
  }

  load(techniques) {
    this.list = techniques.filter((technique) => technique.kind === 'view');
    this.select.replaceChildren(...this.list.map((technique) => make('option', {
      value: technique.name, textContent: technique.name.replaceAll('_', ' '),
    })));
    const first = this.list.find((technique) => technique.name === DEFAULT_TECHNIQUE) ?? this.list[0];
    this.select.value = first.name;
    this.#show();
  }

  get current() {
    return this.list.find((technique) => technique.name === this.select.value);
  }

  /** The parts of the request that this module knows: the technique and its own parameters. */
  read() {
    const { name } = this.current;
    const parameters = this.#of(name).read() ?? {};
    const transfer = this.#hasTransfer(name) ? this.transfer.read() : undefined;
    if (transfer !== undefined) parameters[TRANSFER] = transfer;
    // The planner takes what is not given from the technique whose parameters are there, if only by name.
    if (this.planned.checked) return { technique: 'auto', [name]: parameters };
    return { technique: name, ...(Object.keys(parameters).length > 0 && { [name]: parameters }) };
  }

  #hasTransfer(name) {
    return TRANSFER in (this.list.find((technique) => technique.name === name)?.schema.properties ?? {});
  }

  #of(name) {
    if (!this.#controls.has(name)) {
      const { schema, example } = this.list.find((technique) => technique.name === name);
      this.#controls.set(name, objectControls(resolve(schema, schema), {
        root: schema, pointer: `/${name}`, example: example?.[name], skip: [TRANSFER], changed: this.changed,
      }));
    }
    return this.#controls.get(name);
  }

  #show() {
    const { name, summary, schema } = this.current;
    document.getElementById('technique-summary').textContent = summary ?? '';
    document.getElementById('controls').replaceChildren(this.#of(name).element);
    const editor = document.getElementById('transfer-editor');
    editor.hidden = !this.#hasTransfer(name);
    if (editor.hidden) return;
    const property = resolve(schema.properties[TRANSFER], schema);
    const extras = [property, ...(property.variants ?? [])].find((shape) => shape.properties?.preset);
    this.transfer.setPresets({
      names: presetNames(extras, schema), initial: property.default?.preset, extras, root: schema, pointer: `/${name}/${TRANSFER}`,
    });
  }
}

/** The presets that a schema of a transfer function offers. */
function presetNames(shape, root) {
  const preset = shape && resolve(shape.properties.preset, root);
  const names = preset?.options?.map((option) => option.value) ?? preset?.enum ?? [];
  return names.filter((name) => typeof name === 'string');
}
