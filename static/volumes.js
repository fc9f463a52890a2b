// The volume to look at: uploaded ones, built-ins and the fields that are still being computed; upload and delete.

import { call, json, upload } from './api.js';
import { confirmed, dismiss, showProblem } from './alert.js';
import { objectControls } from './controls.js';
import { brief } from './curve.js';
import { make } from './widgets.js';

const DEFAULT_BUILTIN = 'smoke';

const keyOf = (volume) => (volume.id ? `id:${volume.id}` : `builtin:${volume.builtin}`);

export function bytesWords(bytes) {
  if (!Number.isFinite(bytes)) return '';
  const unit = ['B', 'kB', 'MB', 'GB'].findLastIndex((_, i) => bytes >= 1000 ** i);
  return `${brief(bytes / 1000 ** Math.max(0, unit))} ${['B', 'kB', 'MB', 'GB'][Math.max(0, unit)]}`;
}

export class Volumes {
  list = [];
  #fields = new Map(); // technique name -> its controls

  /** @param {() => void} chosen another volume @param {() => void} changed the same, made otherwise */
  constructor(chosen, changed) {
    this.chosen = chosen;
    this.changed = changed;
    this.select = document.getElementById('volume');
    this.resolution = document.getElementById('resolution');
    this.listElement = document.getElementById('volume-list');
    this.file = document.getElementById('file');
    this.select.addEventListener('change', () => this.#choose());
    this.resolution.addEventListener('change', () => changed());
    this.file.addEventListener('change', () => {
      this.send(this.file.files);
    });
    this.#listenToDrops();
  }

  async load(techniques) {
    this.techniques = techniques.filter((technique) => technique.kind === 'field');
    for (const technique of this.techniques) {
      this.#fields.set(technique.name, objectControls(technique.schema, {
        root: technique.schema,
        pointer: `/volume/${technique.name}`,
        example: technique.example?.volume?.[technique.name] ?? technique.example?.[technique.name],
        changed: () => this.changed(),
      }));
    }
    await this.refresh();
    const first = this.list.find((volume) => volume.id)
      ?? this.list.find((volume) => volume.builtin === DEFAULT_BUILTIN) ?? this.list[0];
    if (first) this.select.value = keyOf(first);
    this.#show();
  }

  async refresh() {
    const { volumes } = await json('v1/volumes');
    const before = this.select.value;
    this.list = volumes;
    const group = (label, options) => (options.length > 0 ? [make('optgroup', { label }, ...options)] : []);
    const option = (volume) => make('option', { value: keyOf(volume), textContent: volume.name || volume.builtin || volume.id });
    this.select.replaceChildren(
      ...group('Uploaded', volumes.filter((volume) => volume.id).map(option)),
      ...group('Built in', volumes.filter((volume) => !volume.id).map(option)),
      ...group('Simulated while you watch', this.techniques.map((technique) => make('option', {
        value: `field:${technique.name}`, textContent: technique.name.replaceAll('_', ' '), title: technique.summary ?? '',
      }))),
    );
    this.select.value = before;
    this.#showList();
  }

  /** The chosen entry of the list, or null for a field. */
  get current() {
    return this.list.find((volume) => keyOf(volume) === this.select.value) ?? null;
  }

  get field() {
    const [kind, name] = this.select.value.split(/:(.*)/s);
    return kind === 'field' ? this.techniques.find((technique) => technique.name === name) ?? null : null;
  }

  /** What goes under "volume" in a request. */
  reference() {
    const { field } = this;
    if (field) return { [field.name]: this.#fields.get(field.name).read(true) };
    const { reference, builtin } = this.current;
    return builtin && this.resolution.value ? { ...reference, resolution: Number(this.resolution.value) } : reference;
  }

  /** What the transfer function editor needs of the chosen volume; of a field, whose values are not known yet, a guess. */
  async subject() {
    const { current } = this;
    if (!current) return { range: [0, 1], counts: null, meanSide: 1, kind: 'density', guessed: true };
    const { histogram, range, dims, spacing, contents } = await json(`v1/volumes/${encodeURIComponent(current.id ?? current.builtin)}`);
    return {
      range: histogram ? [histogram.min, histogram.max] : range,
      counts: histogram?.counts ?? null,
      meanSide: dims.reduce((sum, count, axis) => sum + count * spacing[axis], 0) / dims.length,
      kind: contents?.kind,
      window: contents?.window,
      takenFor: contents && takenFor(contents),
    };
  }

  /** What became known of the volume that is shown. */
  tell(words) {
    if (words) document.getElementById('volume-facts').textContent += ` · ${words}`;
  }

  #choose() {
    this.#show();
    this.chosen();
  }

  #show() {
    const { current, field } = this;
    document.getElementById('resolution-row').hidden = !current?.builtin;
    const controls = document.getElementById('field-controls');
    controls.replaceChildren(...(field ? [this.#fields.get(field.name).element] : []));
    document.getElementById('volume-facts').textContent = current ? facts(current) : field?.summary ?? '';
    for (const item of this.listElement.children) item.classList.toggle('current', item.dataset.key === this.select.value);
  }

  #showList() {
    this.listElement.replaceChildren(...this.list.filter((volume) => volume.id).map((volume) => {
      const name = volume.name || volume.id;
      return make('li', { dataset: { key: keyOf(volume) } },
        make('button', { type: 'button', className: 'link name', textContent: name, onclick: () => this.pick(volume) }),
        make('span', { textContent: `${volume.dims.join(' × ')}, ${bytesWords(volume.bytes)}` }),
        make('button', { type: 'button', className: 'quiet', textContent: 'Delete', ariaLabel: `Delete ${name}`, onclick: () => this.#delete(volume) }));
    }));
    this.#show();
  }

  pick(volume) {
    if (this.select.value === keyOf(volume)) return;
    this.select.value = keyOf(volume);
    this.#choose();
  }

  async #delete(volume) {
    if (!await confirmed(`Delete ${volume.name || 'this volume'} from the server?`)) return;
    const wasCurrent = this.select.value === keyOf(volume);
    try {
      await call(`v1/volumes/${volume.id}`, { method: 'DELETE' });
      await this.refresh();
    } catch (error) {
      showProblem(error, 'The volume was not deleted');
      return;
    }
    if (!wasCurrent) return;
    const next = this.list.find((other) => other.id) ?? this.list.find((other) => other.builtin === DEFAULT_BUILTIN) ?? this.list[0];
    this.select.value = keyOf(next);
    this.#choose();
  }

  async send(files) {
    const row = document.getElementById('upload-progress');
    const [bar, text] = row.children;
    for (const file of [...files]) {
      row.hidden = false;
      dismiss();
      try {
        text.textContent = `Sending ${file.name}`;
        const volume = await upload('v1/volumes', file, (fraction) => {
          if (fraction < 1) bar.value = fraction;
          else bar.removeAttribute('value');
          text.textContent = fraction < 1 ? `Sending ${file.name}: ${Math.floor(100 * fraction)} %` : `Reading ${file.name}`;
        });
        await this.refresh();
        const there = this.list.find((one) => one.id === volume.id);
        if (there) this.pick(there);
      } catch (error) {
        showProblem(error, `${file.name} was not taken`);
      } finally {
        row.hidden = true;
        bar.value = 0;
        text.textContent = '';
        this.file.value = '';
      }
    }
  }

  #listenToDrops() {
    let depth = 0;
    const over = (on) => document.body.classList.toggle('dropping', on);
    const hasFiles = (event) => event.dataTransfer?.types.includes('Files');
    window.addEventListener('dragenter', (event) => {
      if (!hasFiles(event)) return;
      depth += 1;
      over(true);
    });
    window.addEventListener('dragleave', () => {
      depth = Math.max(0, depth - 1);
      if (depth === 0) over(false);
    });
    window.addEventListener('dragover', (event) => { if (hasFiles(event)) event.preventDefault(); });
    window.addEventListener('drop', (event) => {
      depth = 0;
      over(false);
      if (!hasFiles(event)) return;
      event.preventDefault();
      this.send(event.dataTransfer.files);
    });
  }
}

const KINDS = {
  density: 'a density', hounsfield: 'Hounsfield units', labels: 'labels', signed_map: 'a map with values below and above 0', intensity: 'intensities',
};

/** What the server takes a volume for, in words. */
function takenFor({ kind, padding, beyond, window }) {
  const said = [
    `taken for ${KINDS[kind] ?? kind}`,
    padding != null && `${brief(padding)} is no data`,
    beyond && `a few values are beyond ${brief(window[0])} to ${brief(window[1])}`,
  ];
  return said.filter(Boolean).join(' · ');
}

function facts(volume) {
  const unit = volume.unit ? ` ${volume.unit}` : '';
  const said = [
    volume.dims?.join(' × '),
    volume.spacing && `spacing ${[...new Set(volume.spacing.map(brief))].join(' × ')}${unit}`,
    volume.voxel_type,
    volume.range && `values ${brief(volume.range[0])} to ${brief(volume.range[1])}`,
    bytesWords(volume.bytes),
    volume.non_finite > 0 && `${volume.non_finite} values are not finite`,
    ...(volume.notes ?? []),
  ];
  return said.filter(Boolean).join(' · ');
}
