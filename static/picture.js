// The canvas: draws frames as they come, the latest wins, and keeps their numbers as data attributes.

export class Picture {
  #next = null;
  #drawing = false;
  #count = 0;
  #epoch = 0;
  #settled = false;

  /** @param {HTMLCanvasElement} canvas @param {(frame) => void} drawn */
  constructor(canvas, drawn) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d', { alpha: false });
    this.drawn = drawn;
  }

  /** Another render from here on: frames of the one before are dropped. */
  begin(renderId) {
    this.#epoch += 1;
    this.#next = null;
    this.canvas.dataset.renderId = renderId;
    this.restart();
  }

  /** The same render, from another camera. */
  restart() {
    this.#settled = false;
    this.canvas.dataset.final = 'false';
  }

  /** The server has said that no frame will follow the last one. */
  settle() {
    this.#settled = true;
    if (!this.#drawing) this.canvas.dataset.final = 'true';
  }

  show(frame) {
    this.#next = frame;
    if (!this.#drawing) this.#draw();
  }

  async #draw() {
    this.#drawing = true;
    try {
      while (this.#next) {
        const frame = this.#next;
        const epoch = this.#epoch;
        this.#next = null;
        const bitmap = await createImageBitmap(frame.blob, { colorSpaceConversion: 'none' });
        if (epoch === this.#epoch) this.#paint(bitmap, frame);
        bitmap.close();
      }
    } finally {
      this.#drawing = false;
      if (this.#settled) this.canvas.dataset.final = 'true';
    }
  }

  #paint(bitmap, frame) {
    const { canvas } = this;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
    }
    this.context.drawImage(bitmap, 0, 0);
    this.#count += 1;
    canvas.dataset.samples = frame.samples ?? '';
    canvas.dataset.error = frame.error ?? 'unknown';
    canvas.dataset.frame = this.#count;
    this.drawn(frame);
  }

  /** The image size to ask for: the canvas in device pixels, no more than `megapixels`. */
  wantedSize(scaleChoice) {
    const { clientWidth, clientHeight } = this.canvas;
    const ratio = window.devicePixelRatio || 1;
    const most = Math.max(1, scaleChoice) * 1e6;
    const linear = Math.min(1, scaleChoice);
    const width = Math.max(1, clientWidth) * ratio;
    const height = Math.max(1, clientHeight) * ratio;
    const shrink = Math.min(1, Math.sqrt(most / (width * height))) * linear;
    return { width: Math.max(16, Math.floor(width * shrink)), height: Math.max(16, Math.floor(height * shrink)) };
  }
}
