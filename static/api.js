// Every HTTP call of the viewer goes through `call`: it carries the bearer token, waits and tries again when the
// network or the queue says so, and turns a refusal into a `Problem` that has words.

const TOKEN_KEY = 'cloudchamber-token';
const BACKOFF_MS = { first: 500, most: 15000 };

/** A refusal of the server: an RFC 9457 problem document, or what can be said when it sent none. */
export class Problem extends Error {
  constructor(status, document = {}) {
    const detail = document.detail ?? '';
    super(detail || document.title || `The server answered ${status}.`);
    this.status = status;
    this.title = document.title || `The server answered ${status}`;
    this.detail = detail;
    /** @type {{pointer?: string, detail?: string, permitted?: unknown}[]} */
    this.errors = Array.isArray(document.errors) ? document.errors : [];
  }

  static parse(status, text) {
    try {
      const document = JSON.parse(text);
      if (document && typeof document === 'object') return new Problem(status, document);
    } catch { /* not JSON: fall through to the status alone */ }
    return new Problem(status, { detail: text.length < 300 ? text.trim() : '' });
  }
}

/** What the page does while a call waits. `main.js` fills these in. */
export const hooks = {
  /** @type {(kind: 'offline'|'busy', delayMs: number) => void} */
  waiting() {},
  online() {},
  /** @type {(refused: boolean) => Promise<string>} */
  askToken: () => Promise.reject(new Problem(401, { title: 'A bearer token is needed' })),
};

// Not document.baseURI: that keeps a user and password typed into the address, which fetch() refuses.
export const url = (path) => new URL(path, location.href).href;
export const token = () => sessionStorage.getItem(TOKEN_KEY);
export const authorization = () => (token() ? { Authorization: `Bearer ${token()}` } : {});

let asking = null;

/** Asks once, however many calls were refused; `used` is the token they were refused with. */
function renewToken(used) {
  if (used !== token()) return Promise.resolve();
  asking ??= hooks.askToken(used !== null)
    .then((fresh) => sessionStorage.setItem(TOKEN_KEY, fresh))
    .finally(() => { asking = null; });
  return asking;
}

export function sleep(ms, signal) {
  return new Promise((resolve, reject) => {
    signal?.throwIfAborted();
    const timer = setTimeout(done, ms);
    function done() {
      signal?.removeEventListener('abort', stop);
      resolve();
    }
    function stop() {
      clearTimeout(timer);
      reject(signal.reason);
    }
    signal?.addEventListener('abort', stop, { once: true });
  });
}

export const backoffMs = (attempt) => Math.min(BACKOFF_MS.most, BACKOFF_MS.first * 2 ** attempt);

/**
 * One call, repeated until the server answers it: `body` may be a function, asked anew at each attempt.
 * Throws `Problem` for a refusal and `AbortError` when `signal` is aborted.
 */
export async function call(path, { method = 'GET', body, headers = {}, accept = 'application/json', signal } = {}) {
  for (let attempt = 0; ; attempt += 1) {
    const used = token();
    const payload = typeof body === 'function' ? body() : body;
    let response;
    try {
      response = await fetch(url(path), {
        method,
        signal,
        cache: 'no-store',
        headers: {
          Accept: accept,
          // The browser itself says what a form is.
          ...(payload === undefined || payload instanceof FormData ? {} : { 'Content-Type': 'application/json' }),
          ...authorization(),
          ...headers,
        },
        body: payload === undefined || payload instanceof FormData ? payload : JSON.stringify(payload),
      });
    } catch (error) {
      if (signal?.aborted || error.name === 'AbortError') throw error;
      await pause('offline', backoffMs(attempt), signal);
      continue;
    }
    hooks.online();
    if (response.ok) return response;
    if (response.status === 401) {
      await renewToken(used);
      continue;
    }
    const problem = Problem.parse(response.status, await response.text());
    const retryAfterS = Number(response.headers.get('Retry-After'));
    if ((response.status === 429 || response.status === 503) && retryAfterS > 0) {
      await pause('busy', retryAfterS * 1000, signal);
      continue;
    }
    throw problem;
  }
}

async function pause(kind, delayMs, signal) {
  hooks.waiting(kind, delayMs);
  await sleep(delayMs, signal);
}

export const json = async (path, options) => (await call(path, options)).json();

/** Sends a file as it is; `progress` gets a fraction. fetch() cannot report an upload, so this is the old way. */
export function upload(path, file, progress) {
  const used = token();
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('POST', url(path));
    request.setRequestHeader('Accept', 'application/json');
    request.setRequestHeader('Content-Type', 'application/octet-stream');
    request.setRequestHeader('X-Filename', encodeURIComponent(file.name));
    if (used) request.setRequestHeader('Authorization', `Bearer ${used}`);
    request.upload.onprogress = (event) => event.lengthComputable && progress(event.loaded / event.total);
    request.onerror = () => reject(new Problem(0, {
      title: 'The upload was cut off',
      detail: 'The connection to the server was lost while the file was being sent. Try again.',
    }));
    request.onload = () => {
      if (request.status >= 200 && request.status < 300) resolve(JSON.parse(request.responseText));
      else if (request.status === 401) renewToken(used).then(() => upload(path, file, progress)).then(resolve, reject);
      else reject(Problem.parse(request.status, request.responseText));
    };
    request.send(file);
  });
}
