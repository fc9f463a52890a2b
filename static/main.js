// The viewer: puts the parts together. What the user says becomes one request; what the server says becomes the picture.

import { json, Problem } from './api.js';
import { renderAccepted, showProblem } from './alert.js';
import { OrbitCamera } from './camera.js';
import { copyCurl } from './curl.js';
import { showExports } from './exports.js';
import { fieldSubject } from './field.js';
import { listenToKeys } from './keys.js';
import { Picture } from './picture.js';
import { listenToPointers } from './pointer.js';
import { RenderSession } from './session.js';
import { Status } from './status.js';
import { Techniques } from './techniques.js';
import { TransferEditor } from './transfer.js';
import { Volumes } from './volumes.js';
import { showValues } from './widgets.js';

const REPLACE_DELAY_MS = 150; // controls settle before a new render is made
const REPLACE_AT_LATEST_MS = 500; // but a long drag of a slider is followed all the same
const RESIZE_DELAY_MS = 300;
const MOST_LOST_IN_A_ROW = 3;

const byId = (id) => document.getElementById(id);
const camera = new OrbitCamera();
const status = new Status();
const picture = new Picture(byId('picture'), (frame) => {
  document.body.classList.add('has-picture');
  status.frame(frame);
});
let lost = 0;

const session = new RenderSession({
  created(resource) {
    lost = 0;
    renderAccepted();
    picture.begin(resource.id);
    status.created(resource);
    if (!camera.ready && resource.camera) frameVolume(resource.camera);
  },
  frame: (frame) => picture.show(frame),
  moving() {
    picture.restart();
    status.restart();
  },
  settled(resource) {
    status.settled(resource);
    if (resource.state === 'done') picture.settle();
    if (volumes.field && resource.state === 'done') measureField(resource.id);
    if (resource.state === 'failed') showProblem(new Problem(500, { title: 'The render failed', detail: resource.failure ?? '' }));
  },
  refused(error) {
    status.state('refused');
    showProblem(error);
  },
  lost() { // the server has forgotten the render: it was restarted, or the render was old
    lost += 1;
    if (lost <= MOST_LOST_IN_A_ROW) replaceSoon();
    else status.state('lost');
  },
});

// ---- from the controls to one request

const budgetOf = () => {
  const typed = { samples: byId('budget-samples').value, time_ms: byId('budget-time').value, max_error: byId('budget-error').value };
  const said = Object.entries(typed).filter(([, value]) => value !== '').map(([name, value]) => [name, Number(value)]);
  return said.length > 0 ? { budget: Object.fromEntries(said) } : {};
};

function request() {
  const image = picture.wantedSize(Number(byId('scale').value));
  camera.aspect = image.width / image.height;
  byId('image-size').textContent = `${image.width} × ${image.height} pixels`;
  const seed = byId('seed').value;
  return {
    ...techniques.read(),
    volume: volumes.reference(),
    ...(camera.ready && { camera: camera.toRequest() }),
    image,
    ...budgetOf(),
    ...(seed !== '' && { seed: Number(seed) }),
  };
}

let replaceTimer = null;
let firstAsked = 0;

function replaceSoon() {
  picture.restart();
  clearTimeout(replaceTimer);
  firstAsked ||= performance.now();
  const waited = performance.now() - firstAsked;
  replaceTimer = setTimeout(replaceNow, Math.max(0, Math.min(REPLACE_DELAY_MS, REPLACE_AT_LATEST_MS - waited)));
}

function replaceNow() {
  clearTimeout(replaceTimer);
  firstAsked = 0;
  session.replace(request());
}

async function volumeChosen() {
  camera.forget();
  picture.canvas.setAttribute('aria-label', `Volume render of ${volumes.select.selectedOptions[0]?.textContent ?? 'nothing'}`);
  document.body.classList.remove('has-picture');
  const ownPoints = transfer.custom; // they move to the new volume's values first
  if (!ownPoints) replaceSoon();
  try {
    const shown = volumes.select.value;
    const subject = await volumes.subject();
    if (shown !== volumes.select.value) return;
    volumes.tell(subject.takenFor);
    showValues(subject.range);
    transfer.setVolume(subject);
  } catch (error) {
    showProblem(error, 'The volume’s histogram');
  } finally {
    if (ownPoints) replaceSoon();
  }
}

let measured = null;

/** Once a field has been computed, its values are known: the curve moves from the guess to them, later only the histogram does. */
async function measureField(renderId) {
  if (measured === renderId) return;
  measured = renderId;
  const subject = await fieldSubject(renderId).catch(() => null); // without it the editor stays over the guess
  if (!subject || session.id !== renderId) return;
  const { guessed } = transfer.volume;
  if (guessed || !transfer.custom) transfer.setVolume(subject);
  else transfer.setHistogram(subject);
  if (guessed && transfer.custom) replaceSoon();
}

const transfer = new TransferEditor(replaceSoon);
const techniques = new Techniques(transfer, replaceSoon);
const volumes = new Volumes(volumeChosen, replaceSoon);

for (const id of ['budget-samples', 'budget-time', 'budget-error', 'seed', 'scale']) byId(id).addEventListener('change', replaceSoon);

// ---- the camera

/** Takes the server's framing, which is for a square: a tall picture has to be asked for again. */
function frameVolume(framing) {
  camera.adopt(framing);
  if (camera.aspect < 1) session.move(camera.toRequest());
}

const moved = (move) => (...numbers) => {
  if (!camera.ready) return;
  move(...numbers);
  session.move(camera.toRequest());
};
const moves = {
  orbit: moved((right, down) => camera.orbit(right, down)),
  pan: moved((right, down) => camera.pan(right, down)),
  zoom: moved((factor) => camera.zoom(factor)),
  reset: moved(() => camera.reset()),
};
listenToPointers(picture.canvas, moves);

// ---- the page

function togglePanel() {
  const open = document.body.classList.toggle('panel-open');
  document.body.classList.toggle('panel-closed', !open);
  byId('panel-toggle').setAttribute('aria-expanded', String(open));
}
const narrow = window.matchMedia('(max-width: 760px)');
const startPanel = () => {
  document.body.classList.toggle('panel-open', !narrow.matches);
  document.body.classList.toggle('panel-closed', narrow.matches);
  byId('panel-toggle').setAttribute('aria-expanded', String(!narrow.matches));
};
startPanel();
narrow.addEventListener('change', startPanel);
byId('panel-toggle').addEventListener('click', togglePanel);
listenToKeys(moves, { panel: togglePanel, upload: () => byId('file').click(), picture: picture.canvas });
byId('links').addEventListener('click', (event) => {
  if (event.target.id === 'curl') copyCurl(request(), event.target);
});

let size = '';
let resizeTimer = null;
new ResizeObserver(() => {
  clearTimeout(resizeTimer);
  resizeTimer = setTimeout(() => {
    const { width, height } = picture.wantedSize(Number(byId('scale').value));
    if (size !== '' && size !== `${width}x${height}`) replaceSoon();
    size = `${width}x${height}`;
  }, RESIZE_DELAY_MS);
}).observe(byId('stage'));

window.addEventListener('pagehide', () => session.leave());
window.addEventListener('pageshow', (event) => { if (event.persisted) replaceSoon(); });

/** The device in the header: its level and lanes, what it gave up, and how far its kernels are until all are compiled. */
async function showDevice() {
  const { device, level, lanes, gave_up: gaveUp = [], kernels } = await json('v1/device');
  const { built, of, failed } = kernels;
  const compiling = built + failed.length < of;
  byId('device').textContent = [device, `${level}, ${lanes} ${lanes === 1 ? 'lane' : 'lanes'}`,
    ...(compiling ? [`kernels ${built} of ${of}`] : []),
    ...(failed.length > 0 ? [`${failed.length} not available`] : [])].join(' · ');
  byId('device').title = ['The OpenCL device that renders', ...gaveUp.map((what) => `Given up: ${what}`),
    ...failed.map((kernel) => `Does not build: ${kernel}`)].join('\n');
  if (compiling) setTimeout(() => showDevice().catch(() => {}), 1000);
}

async function start() {
  const { techniques: list } = await json('v1/techniques');
  techniques.load(list);
  await volumes.load(list);
  showExports(byId('exports'), list, () => volumes.reference());
  volumeChosen();
  showDevice().catch(() => { /* a line of decoration */ });
}

start().catch((error) => {
  status.state('refused');
  showProblem(error, 'The viewer could not start');
});
