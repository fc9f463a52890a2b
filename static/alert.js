// What the page says when something is wrong: problems in words, the control they mean, and waiting for the network.

import { hooks, Problem } from './api.js';
import { make } from './widgets.js';

const alertBox = document.getElementById('alert');
const notice = document.getElementById('notice');

/** The control for a JSON pointer, or for the nearest thing around it that has one. */
function controlOf(pointer) {
  for (let at = pointer; at; at = at.slice(0, at.lastIndexOf('/'))) {
    const control = document.querySelector(`[data-pointer="${CSS.escape(at)}"]`);
    if (control) return control;
  }
  return null;
}

function permittedWords(permitted) {
  if (permitted === undefined || permitted === null) return '';
  const words = typeof permitted === 'string' ? permitted
    : Array.isArray(permitted) ? permitted.join(', ')
      : Object.entries(permitted).map(([key, value]) => `${key} ${JSON.stringify(value)}`).join(', ');
  return ` (permitted: ${words})`;
}

let shownAbout = '';

/** Shows a refusal until a render is accepted (if it was about one) or until it is closed. `about` says what was tried; '' is the render. */
export function showProblem(error, about = '') {
  dismiss();
  shownAbout = about;
  const title = error instanceof Problem ? error.title : 'Something went wrong in the viewer';
  const text = error instanceof Problem ? error.detail : String(error.message ?? error);
  const list = make('ul');
  for (const one of error.errors ?? []) {
    const pointer = (one.pointer ?? '').replace(/^#/, '');
    const control = pointer && controlOf(pointer);
    const item = make('li', {}, `${one.detail ?? 'is not permitted'}${permittedWords(one.permitted)} `);
    if (pointer) item.prepend(make('code', { textContent: pointer }), ' ');
    if (control) {
      mark(control, one.detail ?? title);
      item.append(make('button', { type: 'button', className: 'link', textContent: 'show', onclick: () => reveal(control) }));
    }
    list.append(item);
  }
  const close = make('button', { type: 'button', className: 'quiet close', textContent: '×', ariaLabel: 'Close this message', onclick: dismiss });
  alertBox.append(
    make('strong', { textContent: about ? `${about}: ${title}` : title }),
    text && text !== title && list.children.length === 0 ? make('p', { textContent: text }) : '',
    list.children.length > 0 ? list : '',
    close,
  );
}

function mark(control, why) {
  control.setAttribute('aria-invalid', 'true');
  control.dataset.why = why;
  control.closest('.field, .row, fieldset')?.classList.add('wrong');
}

function reveal(control) {
  document.body.classList.add('panel-open');
  control.closest('details')?.setAttribute('open', '');
  const focusable = control.matches('input, select, textarea') ? control : control.querySelector('input, select, [tabindex="0"]');
  control.scrollIntoView({ block: 'center' });
  focusable?.focus();
}

/** Takes back what was said about the render, now that one has been accepted. */
export function renderAccepted() {
  if (shownAbout === '') dismiss();
}

export function dismiss() {
  alertBox.replaceChildren();
  for (const control of document.querySelectorAll('[data-why]')) {
    control.removeAttribute('aria-invalid');
    delete control.dataset.why;
  }
  for (const around of document.querySelectorAll('.wrong')) around.classList.remove('wrong');
}

hooks.waiting = (kind, delayMs) => {
  const seconds = Math.max(1, Math.round(delayMs / 1000));
  notice.textContent = kind === 'busy'
    ? `The server is busy; trying again in ${seconds} s.`
    : `The server cannot be reached; trying again in ${seconds} s.`;
};
hooks.online = () => {
  if (notice.textContent) notice.textContent = '';
};

hooks.askToken = (refused) => new Promise((resolve) => {
  const dialog = document.getElementById('token-dialog');
  const box = document.getElementById('token');
  document.getElementById('token-words').textContent = refused
    ? 'It did not accept the token it was given. Try another one.'
    : 'It is kept in this tab until the tab is closed.';
  box.value = '';
  dialog.addEventListener('cancel', (event) => event.preventDefault());
  dialog.addEventListener('close', () => resolve(box.value.trim()), { once: true });
  dialog.showModal();
});

/** Asks before something is deleted. */
export function confirmed(words) {
  const dialog = document.getElementById('confirm');
  document.getElementById('confirm-words').textContent = words;
  dialog.returnValue = 'no';
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener('close', () => resolve(dialog.returnValue === 'yes'), { once: true });
  });
}
