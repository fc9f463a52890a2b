// The life of the one render that the page shows: made, streamed, re-aimed, replaced, cleaned up.

import { backoffMs, call, json, sleep, hooks, Problem, url, authorization } from './api.js';
import { frameOf, parts } from './stream.js';

const GONE = new Set([404, 409]); // forgotten by the server, or ended by somebody else
const MOST_FRAME_WAIT_MS = 2000;
const TERMINAL = new Set(['done', 'cancelled', 'failed']);

export class RenderSession {
  id = null;
  /** The newest camera that the server has not been told, or null. */
  #camera = null;
  #putting = false;
  #streaming = false;
  #moves = 0;
  #awaited = null;
  #turn = 0;
  #abort = new AbortController();

  /**
   * @param {{created(resource), frame(frame), moving(), settled(resource), refused(problem), lost()}} events
   */
  constructor(events) {
    this.events = events;
  }

  /** Ends the render that runs and makes another one. */
  async replace(request) {
    const turn = this.#drop();
    const { signal } = this.#abort;
    try {
      // Not aborted with its turn: an answer that comes too late names a render that must be deleted.
      const response = await call('v1/renders', { method: 'POST', body: () => { signal.throwIfAborted(); return request; } });
      const resource = await response.json();
      if (turn !== this.#turn) {
        this.#delete(resource.id);
        return;
      }
      this.id = resource.id;
      this.events.created(resource);
      this.#putCameras(turn);
      this.#stream(turn);
    } catch (error) {
      if (turn === this.#turn) this.#refuse(error);
    }
  }

  /** Re-aims the render that runs: one PUT and its first frame at a time, and only the newest camera waits. */
  move(camera) {
    this.#camera = camera;
    this.events.moving();
    if (this.id !== null) this.#putCameras(this.#turn);
  }

  /** Leaves nothing running behind a closed page. */
  leave() {
    this.#drop();
  }

  #drop() {
    this.#abort.abort();
    this.#abort = new AbortController();
    if (this.id !== null) this.#delete(this.id);
    this.id = null;
    this.#camera = null;
    this.#putting = false;
    this.#streaming = false;
    this.#turn += 1;
    return this.#turn;
  }

  #delete(id) {
    fetch(url(`v1/renders/${id}`), { method: 'DELETE', headers: authorization(), keepalive: true })
      .catch(() => { /* it ends by its own budget */ });
  }

  #refuse(error) {
    if (error.name === 'AbortError') return;
    if (error instanceof Problem && GONE.has(error.status)) this.events.lost();
    else this.events.refused(error);
  }

  async #putCameras(turn) {
    if (this.#putting) return;
    this.#putting = true;
    const { signal } = this.#abort;
    try {
      while (this.#camera !== null && turn === this.#turn) {
        let sent = null;
        const sentAt = performance.now();
        await call(`v1/renders/${this.id}/camera`, {
          method: 'PUT', signal, body: () => { sent = this.#camera; return sent; },
        });
        if (turn !== this.#turn) return;
        if (this.#camera === sent) this.#camera = null;
        this.#moves += 1;
        this.#stream(turn);
        await this.#frameSince(sentAt, signal);
      }
    } catch (error) {
      if (turn === this.#turn) {
        this.#camera = null;
        this.#refuse(error);
      }
    } finally {
      if (turn === this.#turn) this.#putting = false;
    }
  }

  /**
   * Waits for a frame of the camera that was sent then. Each camera makes the render start again, so without this a long
   * drag on a slow device would show nothing until it ends.
   */
  async #frameSince(sentAt, signal) {
    const seen = new Promise((resolve) => { this.#awaited = { sentAt, resolve }; });
    await Promise.race([seen, sleep(MOST_FRAME_WAIT_MS, signal)]);
  }

  #show(frame) {
    // A frame says how long ago its camera was sent: what is older belongs to the camera before.
    const { sentAt, resolve } = this.#awaited ?? {};
    if (resolve && (frame.elapsedMs ?? 0) <= performance.now() - sentAt) resolve();
    this.events.frame(frame);
  }

  /** Reads frames until the render has ended, through lost connections and camera moves. */
  async #stream(turn) {
    if (this.#streaming) return;
    this.#streaming = true;
    const { signal } = this.#abort;
    const path = `v1/renders/${this.id}`;
    try {
      for (let attempt = 0; turn === this.#turn;) {
        try {
          const response = await call(`${path}/frames`, { accept: 'multipart/x-mixed-replace', signal });
          for await (const part of parts(response)) {
            if (turn !== this.#turn) return;
            attempt = 0;
            this.#show(frameOf(part));
          }
        } catch (error) {
          if (error.name === 'AbortError' || error instanceof Problem) throw error;
          hooks.waiting('offline', backoffMs(attempt)); // the connection broke in the middle of a frame
        }
        const moves = this.#moves;
        const resource = await json(path, { signal });
        if (turn !== this.#turn) return;
        // A camera sent meanwhile has set the render running again, whatever this answer says.
        if (TERMINAL.has(resource.state) && !this.#putting && moves === this.#moves) {
          this.#streaming = false;
          this.events.settled(resource);
          return;
        }
        if (moves !== this.#moves) continue;
        await sleep(backoffMs(attempt) / 5, signal);
        attempt += 1;
      }
    } catch (error) {
      if (turn === this.#turn) {
        this.#streaming = false;
        this.#refuse(error);
      }
    }
  }
}
