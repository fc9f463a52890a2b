// Exports: a button for each technique that turns the chosen volume into a file, which is downloaded.

import { call, json } from './api.js';
import { showProblem } from './alert.js';
import { make } from './widgets.js';

/** The file's name in the answer's header. */
const nameOf = (response, technique) => /filename="([^"]*)"/.exec(response.headers.get('Content-Disposition') ?? '')?.[1] ?? technique.name;

async function download(technique, volume) {
  const body = { technique: technique.name, volume };
  const { links } = await json('v1/exports', { method: 'POST', body });
  const response = await call(`${links.file.slice(1)}?wait=final`, { accept: '*/*' });
  const address = URL.createObjectURL(await response.blob());
  make('a', { href: address, download: nameOf(response, technique) }).click();
  URL.revokeObjectURL(address);
}

/** Fills `element` with a button for each export; `volume` says what goes under "volume" in a request. */
export function showExports(element, techniques, volume) {
  const buttons = techniques.filter((technique) => technique.kind === 'export').map((technique) => {
    const words = technique.name.replaceAll('_', ' ');
    const button = make('button', { type: 'button', textContent: `Export: ${words}`, title: technique.summary });
    button.addEventListener('click', async () => {
      button.disabled = true;
      button.dataset.state = 'working';
      try {
        await download(technique, volume());
        button.dataset.state = 'done';
      } catch (error) {
        button.dataset.state = 'failed';
        showProblem(error, `The export ${words}`);
      } finally {
        button.disabled = false;
      }
    });
    return button;
  });
  element.replaceChildren(...buttons);
}
