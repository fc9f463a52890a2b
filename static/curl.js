// "Copy as curl": the picture on the page as a command line.

import { token, url } from './api.js';

const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

export function curlOf(request) {
  return [
    `curl -sS ${quoted(url('v1/renders'))}`,
    ...(token() ? ['  -H "Authorization: Bearer $CLOUDCHAMBER_TOKEN"'] : []),
    "  -H 'Content-Type: application/json' -H 'Accept: image/png'",
    `  -d ${quoted(JSON.stringify(request))}`,
    '  -o render.png',
  ].join(' \\\n');
}

/** Copies, or where the browser forbids that (plain HTTP), shows the text to copy by hand. */
export async function copyCurl(request, button) {
  const text = curlOf(request);
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = 'Copied';
    setTimeout(() => { button.textContent = 'Copy as curl'; }, 1500);
  } catch {
    const box = document.getElementById('curl-text');
    box.value = text;
    document.getElementById('curl-dialog').showModal();
    box.select();
  }
}
