// Orbit without roll: the camera turns about an up axis through the target. No DOM, no network.

const POLE_RAD = (89 * Math.PI) / 180;
const ZOOM_RANGE = { nearest: 0.02, farthest: 30 }; // of the home distance

const add = (a, b) => a.map((x, i) => x + b[i]);
const sub = (a, b) => a.map((x, i) => x - b[i]);
const scale = (a, s) => a.map((x) => x * s);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => scale(a, 1 / (length(a) || 1));
const across = (a, axis) => sub(a, scale(axis, dot(a, axis)));
const tidy = (a) => a.map((x) => Number(x.toPrecision(7)) + 0);

/** The coordinate axis that `up` means, if seen from this direction it is the same up; else `up` itself. */
function upAxis(up, forward) {
  const given = unit(up);
  const largest = given.reduce((best, x, i) => (Math.abs(x) > Math.abs(given[best]) ? i : best), 0);
  const axis = [0, 0, 0].map((_, i) => (i === largest ? Math.sign(given[i]) : 0));
  return dot(unit(across(axis, forward)), unit(across(given, forward))) > 0.9999 ? axis : given;
}

export class OrbitCamera {
  /** @type {{eye: number[], target: number[], up: number[], fov_y_deg: number}|null} */
  home = null;
  /** Width over height of the picture. */
  aspect = 1;

  /** Takes the server's framing as the home view. */
  adopt(camera) {
    this.home = structuredClone(camera);
    this.reset();
  }

  forget() {
    this.home = null;
  }

  reset() {
    const { eye, target, up, fov_y_deg: fovYDeg, ...rest } = this.home;
    const offset = sub(eye, target);
    this.rest = rest; // what else the server's camera says (its projection) is sent back untouched
    this.fovYDeg = fovYDeg;
    this.target = target;
    this.distance = length(offset);
    this.up = upAxis(up, unit(offset));
    const level = across(offset, this.up);
    const anyLevel = across(Math.abs(this.up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], this.up);
    this.front = unit(length(level) > 1e-6 * this.distance ? level : anyLevel);
    this.side = cross(this.up, this.front);
    this.yaw = 0;
    this.pitch = Math.asin(Math.max(-1, Math.min(1, dot(offset, this.up) / this.distance)));
  }

  get ready() {
    return this.home !== null;
  }

  /** From the target to the eye, of length 1. */
  outward() {
    const level = add(scale(this.front, Math.cos(this.yaw)), scale(this.side, Math.sin(this.yaw)));
    return add(scale(level, Math.cos(this.pitch)), scale(this.up, Math.sin(this.pitch)));
  }

  /** Turns by radians; positive is the scene following a drag to the right and down. */
  orbit(right, down) {
    this.yaw -= right;
    const limit = Math.max(POLE_RAD, Math.abs(this.pitch));
    this.pitch = Math.max(-limit, Math.min(limit, this.pitch + down));
  }

  /** Moves the scene by fractions of the picture's height, to the right and down. */
  pan(right, down) {
    const outward = this.outward();
    const cameraRight = unit(cross(this.up, outward));
    const cameraUp = cross(outward, cameraRight);
    const heightAtTarget = 2 * this.distance * this.#tangent;
    this.target = add(this.target, add(scale(cameraRight, -right * heightAtTarget), scale(cameraUp, down * heightAtTarget)));
  }

  /** Of half the vertical angle of view. The server frames for a square: what a tall picture lacks in width it gets in angle. */
  get #tangent() {
    return Math.tan((this.fovYDeg * Math.PI) / 360) / Math.min(1, this.aspect);
  }

  /** Multiplies the distance. */
  zoom(factor) {
    const homeDistance = length(sub(this.home.eye, this.home.target));
    this.distance = Math.max(homeDistance * ZOOM_RANGE.nearest,
      Math.min(homeDistance * ZOOM_RANGE.farthest, this.distance * factor));
  }

  /** The camera as the API takes it. */
  toRequest() {
    return {
      ...this.rest,
      eye: tidy(add(this.target, scale(this.outward(), this.distance))),
      target: tidy(this.target),
      up: tidy(this.up),
      fov_y_deg: Number(((Math.atan(this.#tangent) * 360) / Math.PI).toPrecision(7)),
    };
  }
}
