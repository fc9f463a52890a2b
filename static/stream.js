// Reads multipart/x-mixed-replace (RFC 2046 framing) from a fetch() response, one part at a time.

const CRLF2 = [13, 10, 13, 10];
const MAX_HEADER_BYTES = 16384;

/** A byte queue over a stream: asks the network only when what is asked of it has not arrived. */
class Bytes {
  constructor(reader) {
    this.reader = reader;
    this.held = new Uint8Array(0);
  }

  async more() {
    const { done, value } = await this.reader.read();
    if (done) return false;
    const joined = new Uint8Array(this.held.length + value.length);
    joined.set(this.held);
    joined.set(value, this.held.length);
    this.held = joined;
    return true;
  }

  /** Takes `count` bytes, or null at the end of the stream. Large parts are gathered without copying twice. */
  async take(count) {
    const taken = new Uint8Array(count);
    let filled = Math.min(count, this.held.length);
    taken.set(this.held.subarray(0, filled));
    this.held = this.held.slice(filled);
    while (filled < count) {
      const { done, value } = await this.reader.read();
      if (done) return null;
      const wanted = Math.min(count - filled, value.length);
      taken.set(value.subarray(0, wanted), filled);
      filled += wanted;
      if (wanted < value.length) this.held = value.slice(wanted);
    }
    return taken;
  }

  /** Takes all before `pattern` and drops the pattern; null at the end of the stream. */
  async until(pattern, limit = Infinity) {
    for (let from = 0; ;) {
      const at = find(this.held, pattern, from);
      if (at >= 0) {
        const before = this.held.slice(0, at);
        this.held = this.held.slice(at + pattern.length);
        return before;
      }
      if (this.held.length > limit) throw new Error('a part of the frame stream has no end to its headers');
      from = Math.max(0, this.held.length - pattern.length + 1);
      if (!await this.more()) return null;
    }
  }
}

function find(bytes, pattern, from) {
  for (let at = bytes.indexOf(pattern[0], from); at >= 0; at = bytes.indexOf(pattern[0], at + 1)) {
    if (at + pattern.length > bytes.length) return -1;
    if (pattern.every((byte, i) => bytes[at + i] === byte)) return at;
  }
  return -1;
}

function parseHeaders(bytes) {
  const headers = new Headers();
  for (const line of new TextDecoder('latin1').decode(bytes).split('\r\n')) {
    const colon = line.indexOf(':');
    if (colon > 0) headers.append(line.slice(0, colon).trim(), line.slice(colon + 1).trim());
  }
  return headers;
}

export function boundaryOf(contentType) {
  const found = /boundary=(?:"([^"]+)"|([^;\s]+))/i.exec(contentType ?? '');
  return found ? found[1] ?? found[2] : null;
}

/**
 * The parts of a multipart response, as `{headers, bytes}`, until its closing boundary or its end.
 * @param {Response} response
 */
export async function* parts(response) {
  const boundary = boundaryOf(response.headers.get('Content-Type'));
  if (!boundary) throw new Error('the frame stream has no boundary');
  const delimiter = [...new TextEncoder().encode(`--${boundary}`)];
  const bytes = new Bytes(response.body.getReader());
  try {
    while (await bytes.until(delimiter) !== null) {
      const start = await bytes.take(2);
      if (start === null || (start[0] === 45 && start[1] === 45)) return; // "--": the closing boundary
      bytes.held = Uint8Array.from([...start, ...bytes.held]);
      const head = await bytes.until(CRLF2, MAX_HEADER_BYTES);
      if (head === null) return;
      const headers = parseHeaders(head);
      const length = headers.get('Content-Length');
      const body = length === null
        ? await bytes.until([13, 10, ...delimiter])
        : await bytes.take(Number(length));
      if (body === null) return;
      if (length === null) bytes.held = Uint8Array.from([...delimiter, ...bytes.held]);
      yield { headers, bytes: body };
    }
  } finally {
    bytes.reader.cancel().catch(() => { /* already gone */ });
  }
}

/** What the headers of one frame say. `error` is null while it is unknown. */
export function frameOf({ headers, bytes }) {
  const number = (name) => {
    const text = headers.get(`X-Cloudchamber-${name}`);
    const value = text === null || text === '' ? NaN : Number(text);
    return Number.isFinite(value) ? value : null;
  };
  return {
    blob: new Blob([bytes], { type: headers.get('Content-Type') ?? 'image/png' }),
    samples: number('Samples'),
    error: number('Error'),
    elapsedMs: number('Elapsed-Ms'),
    lowered: headers.get('X-Cloudchamber-Lowered') ?? '',
    final: headers.get('X-Cloudchamber-Final') === 'true',
  };
}
