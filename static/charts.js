// The Charts page: what was measured, what to choose when, and where methods fail.

import { call, hooks, json, Problem } from './api.js';
import { showProblem } from './alert.js';
import { make } from './widgets.js';

const byId = (id) => document.getElementById(id);
const VERDICTS = { exact: 'told', unbiased: 'told', within: 'told', 'biased and flagged': 'flagged', 'diverges and flagged': 'flagged' };

const row = (cell, ...cells) => make('tr', {}, ...cells.map((content) => make(cell, {}, content)));
const milliseconds = (ms) => `${Number(ms.toPrecision(3))} ms`;

/** Words with `names` set as code. */
const prose = (text) => make('span', {}, ...text.split('`').map((part, i) => (i % 2 ? make('code', { textContent: part }) : part)));

/** The fastest setting within a bound, in words. */
const fastest = (choice) => (choice?.setting ? `${choice.setting}: ${milliseconds(choice.device_ms)}` : 'none tried');

/** A chart that is fetched when it comes near: with the token, which an <img> would not send. */
function chart(href, words, className = '') {
  const image = make('img', { alt: words, className });
  const seen = new IntersectionObserver(async ([entry]) => {
    if (!entry.isIntersecting) return;
    seen.disconnect();
    try {
      image.src = URL.createObjectURL(await (await call(href.slice(1), { accept: 'image/svg+xml' })).blob());
    } catch (error) {
      image.alt = `${words}: ${error.message}`;
    }
  }, { rootMargin: '600px' });
  seen.observe(image);
  return make('figure', {}, image);
}

function showCases(studies) {
  byId('choose').replaceChildren(
    row('th', 'You have', 'Choose', 'Error 10 %', 'Error 1 %', 'Error 0.1 %'),
    ...studies.map((study) => row('td', make('a', { href: `#${study.name}`, textContent: study.when }), prose(study.choose),
      ...study.equal_error.map(fastest))),
  );
  byId('cases').replaceChildren(...studies.map((study) => make('article', { id: study.name },
    make('h3', { textContent: study.title }),
    make('p', { textContent: `Truth: ${study.truth}.${study.quick ? ' The quick form.' : ''}` }),
    chart(study.charts[0], study.title),
    make('a', { href: study.href.slice(1), textContent: 'numbers' }))));
}

function showStability(stability) {
  const short = (title) => title.split(':')[0];
  byId('verdicts').replaceChildren(
    row('th', 'Experiment', 'Expected', 'Verdict', 'Warnings'),
    ...stability.experiments.map((one) => row('td',
      make('a', { href: `#experiment-${one.name}`, textContent: short(one.title) }), one.expected,
      make('span', { textContent: one.verdict, className: VERDICTS[one.verdict] ?? 'silent' }), one.warnings.join(', '))),
    ...stability.not_here_yet.map(([what, technique]) => row('td', what, '–', `not here yet: ${technique}`, '')),
  );
  byId('experiments').replaceChildren(...stability.experiments.map((one) => make('article', { id: `experiment-${one.name}` },
    make('h3', { textContent: short(one.title) }),
    one.title === short(one.title) ? null : make('p', { textContent: one.title }),
    ...one.charts.map((href, i) => chart(href, one.title, i > 0 ? 'map' : '')))));
}

function showPlanner(planner) {
  const { scenes, error_met: met, in_time: timed, cheap, machine, href } = planner;
  byId('planner').replaceChildren(
    make('h2', { textContent: 'Does the planner keep its word?' }),
    make('p', { textContent: `Of ${scenes} random scenes on ${machine.device}, ${machine.threads} threads: ${met} pictures are no more wrong than was asked, ${timed} took what was predicted within a factor of 1.5, ${cheap} cost at most 1.3 times the cheapest setting that would have done. ` }),
    make('a', { href: href.slice(1), textContent: 'numbers' }));
}

function showHonesty(honesty) {
  const { scenes, known, covered, nearly, median, above, asked, within, machines, href, charts } = honesty;
  const part = (n, of) => `${Number((100 * n / of).toPrecision(3))} %`;
  const words = `Of ${scenes} random scenes, ${known} have a stated error and a truth that is known well enough. `
    + `The true error is at most the stated one in ${part(covered, known)} of them, and at most 1.5 times that in ${part(nearly, known)}; the median of stated over true is ${median?.toFixed(2)}, and ${part(above, known)} state more than 4 times too much. `
    + `Of ${asked} renders that stopped because they had reached the error asked for, ${within} are within it. Measured on ${machines}. `;
  byId('honesty').replaceChildren(
    make('h2', { textContent: 'How far can a stated error be trusted?' }),
    make('p', { textContent: words }),
    chart(charts[0], 'Stated against true errors'),
    make('a', { href: href.slice(1), textContent: 'numbers' }));
}

hooks.askToken = () => Promise.reject(new Problem(401, { title: 'A bearer token is needed: give it in the viewer, in this tab' }));

try {
  const { studies, stability, planner, honesty } = await json('v1/studies');
  const machine = (studies[0] ?? stability?.experiments[0])?.machine;
  if (machine) byId('device').textContent = `measured on ${machine.processor}, ${machine.threads} threads, ${machine.device}; ${machine.commit}`;
  showCases(studies);
  if (stability) showStability(stability);
  if (honesty?.known) showHonesty(honesty);
  if (planner) showPlanner(planner);
  if (location.hash) byId(location.hash.slice(1))?.scrollIntoView();
} catch (error) {
  showProblem(error, 'Charts');
}
