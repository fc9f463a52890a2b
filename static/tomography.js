// The Tomography page: a volume is projected or a sinogram uploaded, looked at, and reconstructed beside it.

import { call, hooks, json, Problem } from './api.js';
import { dismiss, showProblem } from './alert.js';
import { make } from './widgets.js';

const byId = (id) => document.getElementById(id);
const METHODS = ['fbp', 'backprojection'];
const SIDE = 384;
/** What is measured exactly: phantoms, with the detectors that see them. */
const head = (dimensions) => ({ phantom: { name: 'shepp_logan', dimensions, radius_mm: 100 } });
const PHANTOMS = [
  ['Shepp and Logan’s head, exactly', { of: head(2), geometry: { detector: { count: [256, 1] } } }],
  ['The same in three dimensions', { of: head(3), geometry: { detector: { count: [128, 96], spacing_mm: [2, 2] } } }],
];

/** A number with three digits. */
const short = (value) => String(Number(Number(value).toPrecision(3)));
const option = (value, text = value) => make('option', { value, textContent: text });

/** Runs `work` with `element` marked as busy. A refusal is shown; a newer run of the same element supersedes this one. */
const turns = new WeakMap();
async function busy(element, about, work) {
  const turn = (turns.get(element) ?? 0) + 1;
  turns.set(element, turn);
  element.setAttribute('aria-busy', 'true');
  try {
    await work(() => turns.get(element) === turn);
    if (turns.get(element) === turn) dismiss();
  } catch (error) {
    if (turns.get(element) === turn) showProblem(error, about);
  } finally {
    if (turns.get(element) === turn) element.removeAttribute('aria-busy');
  }
}

async function showImage(image, path, isNewest, words) {
  const address = URL.createObjectURL(await (await call(path, { accept: 'image/png' })).blob());
  if (!isNewest()) return;
  if (image.src) URL.revokeObjectURL(image.src);
  Object.assign(image, { src: address, alt: words });
}

/** The sinogram that is chosen, as the server describes it. */
let shown = null;

async function listSinograms(chosen) {
  const { sinograms } = await json('v1/sinograms');
  byId('sinogram').replaceChildren(...sinograms.toReversed().map(({ id, name, views, bins }) =>
    option(id, `${name}, ${views} × ${bins.join(' × ')}`)));
  if (chosen) byId('sinogram').value = chosen;
  if (byId('sinogram').value) await chooseSinogram();
}

function showCheck() {
  const words = [...(shown.notes ?? []), ...(shown.warnings ?? [])];
  const items = words.map((text) => make('li', { textContent: text }));
  if (items.length === 0) items.push(make('li', { className: 'good', textContent: 'The data check finds nothing wrong.' }));
  byId('check').replaceChildren(...items);
}

async function showPreview() {
  const view = Number(byId('view').value);
  const [low, high] = shown.range;
  const what = view < 0 ? (shown.bins[1] > 1 ? 'The middle row of all views' : 'All views') : `View ${view}`;
  byId('view-words').textContent = `${what}; line integrals from ${short(low)} to ${short(high)}`;
  const path = `v1/sinograms/${shown.id}/preview.png${view < 0 ? '' : `?view=${view}`}`;
  await busy(byId('preview'), 'The sinogram', (isNewest) => showImage(byId('preview'), path, isNewest, what));
}

async function chooseSinogram(isNewest = () => true) {
  const chosen = await json(`v1/sinograms/${byId('sinogram').value}`);
  if (!isNewest()) return;
  shown = chosen;
  Object.assign(byId('view'), { max: shown.views - 1, value: -1, disabled: shown.bins[1] === 1 });
  Object.assign(byId('numbers'), { href: `v1/sinograms/${shown.id}/data`, hidden: false });
  showCheck();
  await Promise.all([showPreview(), reconstruct()]);
}

/** The chosen method as a field of a request. */
function field() {
  const technique = byId('technique').value;
  const own = { sinogram: { id: shown.id } };
  if (technique === 'fbp') Object.assign(own, { filter: byId('filter').value, cutoff: Number(byId('cutoff').value) });
  if (technique === 'backprojection') own.deconvolve = byId('deconvolve').checked;
  return { [technique]: own };
}

async function reconstruct() {
  for (const element of document.querySelectorAll('[data-of]')) element.hidden = element.dataset.of !== byId('technique').value;
  if (!shown) return;
  await busy(byId('reconstruction'), 'The reconstruction', async (isNewest) => {
    // From +z, as near as all of the grid is seen at the default angle, whose tangent of half is 0.5.
    const wide = shown.bins[0] * shown.geometry.detector.spacing_mm[0];
    const camera = { eye: [0, 0, 1.05 * wide], target: [0, 0, 0], up: [0, 1, 0] };
    const body = { technique: 'slice', volume: field(), camera, image: { width: SIDE, height: SIDE }, budget: { samples: 4 } };
    const { links } = await json('v1/renders', { method: 'POST', body });
    await showImage(byId('reconstruction'), `${links.png.slice(1)}?wait=final`, isNewest, `${byId('technique').value} of ${shown.name}`);
    const { result, timings } = await json(links.self.slice(1));
    if (!isNewest()) return;
    byId('facts').textContent = `${result.views} views, ${short(result.device_ms)} ms on the device, ${short(timings.elapsed_ms)} ms in all`;
    byId('expect').replaceChildren(...result.warnings.map(({ message }) => make('li', { textContent: message })));
  });
}

/** Measures what is chosen, and keeps the sinogram. */
async function measure(isNewest) {
  const angles = { from: 0, to: Number(byId('measured-to').value), count: Number(byId('measured-views').value) };
  const { of, geometry } = JSON.parse(byId('volume').value);
  const { links } = await json('v1/projections', { method: 'POST', body: { of, geometry: { ...geometry, angles_deg: angles } } });
  await call(`${links.file.slice(1)}?wait=final`, { accept: '*/*' });
  const { result } = await json(links.self.slice(1));
  if (isNewest()) await listSinograms(result.sinogram.id);
}

/** Uploads the files of the form. */
async function upload(isNewest) {
  const body = new FormData();
  if (!byId('says-it').checked) {
    const value = (id) => Number(byId(id).value);
    const spacing = value('spacing');
    const file = byId('data').files[0];
    const meta = {
      quantity: byId('quantity').value,
      geometry: { angles_deg: { from: value('from'), to: value('to') }, detector: { spacing_mm: [spacing, spacing] } },
      ...(byId('photons').value && byId('quantity').value === 'counts' ? { photons_per_ray: value('photons') } : {}),
    };
    if (file.name.endsWith('.raw')) throw new Problem(422, { title: 'Bare numbers', detail: 'Their type and size are not asked for here: use curl, or NumPy’s .npy.' });
    body.append('meta', JSON.stringify(meta));
  }
  for (const id of ['data', 'flat', 'dark']) if (byId(id).files[0]) body.append(id, byId(id).files[0]);
  const { id } = await json('v1/sinograms', { method: 'POST', body });
  if (isNewest()) await listSinograms(id);
}

function showMeta() {
  byId('meta').hidden = byId('says-it').checked;
  for (const input of byId('meta').querySelectorAll('input')) input.disabled = byId('says-it').checked;
  for (const row of document.querySelectorAll('[data-only]')) row.hidden = !row.dataset.only.split(' ').includes(byId('quantity').value);
}

function submits(form, about, work) {
  byId(form).addEventListener('submit', (event) => {
    event.preventDefault();
    busy(byId(form), about, work);
  });
}

hooks.askToken = () => Promise.reject(new Problem(401, { title: 'A bearer token is needed: give it in the viewer, in this tab' }));

try {
  submits('measure', 'The projection', measure);
  submits('upload', 'The upload', upload);
  byId('sinogram').addEventListener('change', () => busy(byId('sinogram'), 'The sinogram', chooseSinogram));
  byId('view').addEventListener('input', showPreview);
  byId('method').addEventListener('change', reconstruct);
  byId('method').addEventListener('submit', (event) => event.preventDefault());
  for (const id of ['says-it', 'quantity']) byId(id).addEventListener('change', showMeta);
  showMeta();
  const [{ techniques }, { volumes }] = await Promise.all([json('v1/techniques'), json('v1/volumes')]);
  const methods = techniques.filter(({ name }) => METHODS.includes(name));
  byId('technique').replaceChildren(...METHODS.map((name) => option(name)));
  const { filter } = methods.find(({ name }) => name === 'fbp').schema.properties;
  byId('filter').replaceChildren(...(filter.enum ?? filter.oneOf.map((one) => one.const)).map((name) => option(name, name.replaceAll('_', ' '))));
  byId('volume').replaceChildren(
    ...PHANTOMS.map(([name, measured]) => option(JSON.stringify(measured), name)),
    ...volumes.map(({ name, reference }) => option(JSON.stringify({ of: reference }), `${name}, ${reference.builtin ? 'built in' : 'uploaded'}`)),
  );
  await Promise.all([listSinograms(), reconstruct()]);
} catch (error) {
  showProblem(error, 'Tomography');
}
