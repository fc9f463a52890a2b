// What the page says about the render: the bar under the picture and the section "This render".

import { call, token } from './api.js';
import { brief } from './curve.js';
import { make } from './widgets.js';

const byId = (id) => document.getElementById(id);
const STOPPED = { samples: 'samples', time: 'time', error: 'error reached' };

/** Two or three significant digits of a percentage. */
export function percent(fraction) {
  if (!Number.isFinite(fraction)) return 'unknown';
  const value = 100 * fraction;
  if (value === 0) return '0 %';
  return value < 0.001 ? `${value.toExponential(1)} %` : `${Number(value.toPrecision(value < 10 ? 2 : 3))} %`;
}

export const milliseconds = (ms) => {
  if (!Number.isFinite(ms)) return '–';
  return ms >= 10000 ? `${(ms / 1000).toFixed(1)} s` : `${ms < 10 ? Number(ms.toPrecision(2)) : Math.round(ms)} ms`;
};

const set = (id, text) => {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
};

export class Status {
  #first = true;
  #chartUrl = null;
  /** What the planner expects of this render, until the camera moves. */
  #planned = null;

  constructor() {
    byId('links').addEventListener('click', (event) => this.#fetchWithToken(event));
  }

  state(name) {
    set('state', name);
    byId('status').dataset.state = name;
  }

  /** A new render, or the same from another camera: numbers start again. */
  restart() {
    this.#first = true;
    this.#planned = null;
    this.state('running');
    set('stopped', '–');
  }

  created(resource) {
    this.restart();
    this.#planned = resource.plan?.planned ?? null;
    this.state(resource.state ?? 'queued');
    this.#plan(resource.plan);
    this.#links(resource.id);
    byId('warnings').replaceChildren();
    byId('counts').replaceChildren();
    byId('result').replaceChildren();
    this.#report(resource);
  }

  frame(frame) {
    // A finished render that is set running again shows its last frame once more: that is not the first of the new one.
    if (this.#first && !frame.final) {
      set('first-frame', milliseconds(frame.elapsedMs));
      this.#first = false;
    }
    set('samples', frame.samples === null ? '–' : String(frame.samples));
    const unknown = frame.final ? 'not known' : 'not known yet';
    set('error', frame.error === null ? unknown : this.#error(frame.error, frame.samples));
    set('elapsed', milliseconds(frame.elapsedMs));
    set('lowered', frame.lowered ? `Lowered for now: ${frame.lowered}` : '');
    byId('lowered').hidden = !frame.lowered;
    if (!frame.final) this.state('running');
  }

  settled(resource) {
    this.state(resource.state);
    const { timings = {} } = resource;
    if (Number.isFinite(resource.samples)) set('samples', String(resource.samples));
    set('error', Number.isFinite(resource.error) ? this.#error(resource.error, resource.samples) : 'not known');
    if (Number.isFinite(timings.elapsed_ms)) set('elapsed', milliseconds(timings.elapsed_ms));
    if (Number.isFinite(timings.first_frame_ms)) set('first-frame', milliseconds(timings.first_frame_ms));
    set('stopped', STOPPED[resource.stopped_by] ?? resource.stopped_by ?? '–');
    this.#plan(resource.plan);
    this.#report(resource);
    this.#chart(resource.id);
  }

  /** A picture of few samples knows only a bound; once it has those that were planned, the plan's pilots knew better. */
  #error(error, samples) {
    const planned = this.#planned;
    const better = planned && samples >= planned.samples && planned.error.value < error;
    return better ? `${percent(planned.error.value)} by the plan (at most ${percent(error)})` : percent(error);
  }

  #report(resource) {
    byId('warnings').replaceChildren(...(resource.warnings ?? [])
      .map((warning) => make('li', { textContent: wordsOf(warning), title: warning.code ?? '' })));
    const { unknown, ...error } = resource.error_parts ?? {};
    const parts = Object.entries(error).filter(([name, part]) => name !== 'total' && Number.isFinite(part));
    const rows = [...parts.map(([name, part]) => [name, percent(part)]), ...(unknown ? [['not known', unknown]] : [])];
    byId('error-parts').replaceChildren(...table('Error, by its causes', rows));
    const counts = Object.entries(resource.counts ?? {}).filter(([, count]) => Number(count) > 0);
    byId('counts').replaceChildren(...table('Counts', counts));
    byId('result').replaceChildren(...table('Computed besides', flat(resource.result ?? {})));
  }

  #plan(plan) {
    if (!plan) return;
    const wasOpen = byId('plan').querySelector('details')?.open ?? false;
    const said = [...(plan.planned?.reasons ?? []), ...(plan.reasons ?? [])];
    const reasons = said.map((reason) => make('li', { textContent: typeof reason === 'string' ? reason : reason.message ?? JSON.stringify(reason) }));
    byId('plan').replaceChildren(
      make('p', { className: 'facts', textContent: plan.technique ? `Planned: ${plan.technique.replaceAll('_', ' ')}${predicted(plan.planned)}` : '' }),
      ...(reasons.length > 0 ? [make('details', { open: wasOpen },
        make('summary', { textContent: `Why: ${reasons.length} ${reasons.length === 1 ? 'reason' : 'reasons'}` }),
        make('ul', { className: 'reasons' }, ...reasons))] : []),
    );
  }

  #links(id) {
    const path = `v1/renders/${id}`;
    const link = (text, href, download) => make('a', { href, textContent: text, ...(download ? { download } : { target: '_blank', rel: 'noopener' }) });
    byId('links').replaceChildren(
      link('PNG', `${path}/frame.png`, `cloudchamber-${id}.png`),
      link('EXR', `${path}/frame.exr`, `cloudchamber-${id}.exr`),
      link('JSON', path),
      make('button', { type: 'button', id: 'curl', className: 'link', textContent: 'Copy as curl' }),
    );
  }

  /** A link cannot carry a bearer token: with one, its target is fetched and handed over as a blob. */
  async #fetchWithToken(event) {
    const anchor = event.target.closest('a');
    if (!anchor || !token() || anchor.href.startsWith('blob:')) return;
    event.preventDefault();
    const response = await call(anchor.getAttribute('href'), { accept: '*/*' });
    const blobUrl = URL.createObjectURL(await response.blob());
    make('a', { href: blobUrl, download: anchor.download, target: '_blank' }).click();
    setTimeout(() => URL.revokeObjectURL(blobUrl), 60000);
  }

  async #chart(id) {
    const image = byId('convergence');
    try {
      const blob = await (await call(`v1/renders/${id}/convergence.svg`, { accept: 'image/svg+xml' })).blob();
      if (this.#chartUrl) URL.revokeObjectURL(this.#chartUrl);
      this.#chartUrl = URL.createObjectURL(blob);
      image.src = this.#chartUrl;
      image.hidden = false;
    } catch {
      image.hidden = true; // a render that was replaced meanwhile has no chart
    }
  }
}

/** What the planner expects, where it was asked. */
function predicted(planned) {
  if (!planned) return '';
  const photons = planned.photons ? `${brief(planned.photons)} photons, ` : '';
  return `, ${photons}${planned.samples} ${planned.samples === 1 ? 'sample' : 'samples'}, about ${milliseconds(planned.device_ms.value)} on the device, ${percent(planned.error.value)} wrong`;
}

function table(caption, rows) {
  if (rows.length === 0) return [];
  return [make('table', {}, make('caption', { textContent: caption }), make('tbody', {}, ...rows.map(([name, value]) => make('tr', {},
    make('th', { scope: 'row', textContent: name.replaceAll('_', ' ') }),
    make('td', { textContent: typeof value === 'number' ? brief(value) : String(value) })))))];
}

/** The numbers and words of a nested result, as rows. */
function flat(value, prefix = '') {
  return Object.entries(value).flatMap(([name, inner]) => {
    const path = prefix ? `${prefix} ${name}` : name;
    if (inner !== null && typeof inner === 'object' && !Array.isArray(inner)) {
      const { value: mean, standard_error: error, ...rest } = inner;
      const estimate = Number.isFinite(mean) && Number.isFinite(error) && Object.keys(rest).length === 0;
      return estimate ? [[path, `${brief(mean)} ± ${brief(error)}`]] : flat(inner, path);
    }
    if (Array.isArray(inner)) return inner.length <= 4 && inner.every((x) => typeof x !== 'object') ? [[path, inner.map((x) => (typeof x === 'number' ? brief(x) : x)).join(', ')]] : [];
    return inner === null ? [] : [[path, inner]];
  });
}

/** A warning with what was measured and what is permitted, where it says so. */
function wordsOf(warning) {
  const number = (value) => (typeof value === 'number' ? Number(value.toPrecision(3)) : JSON.stringify(value));
  const measured = warning.measured === undefined ? '' : ` (measured ${number(warning.measured)}, bound ${number(warning.bound)})`;
  return `${warning.message ?? warning.code ?? String(warning)}${measured}`;
}
