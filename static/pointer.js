// Mouse, touch and wheel on the picture -> camera moves. One pointer orbits; the right button, shift or two fingers pan.

const RADIANS_PER_HEIGHT = Math.PI; // a drag over the whole height is half a turn
const WHEEL_LINE_PX = 16;
const WHEEL_ZOOM_PER_PX = 0.0015;
const MOST_WHEEL_PX = 240; // one event zooms by no more than a third

/**
 * @param {HTMLElement} element
 * @param {{orbit(right, down), pan(right, down), zoom(factor), reset()}} moves
 */
export function listenToPointers(element, moves) {
  const held = new Map();

  const centreAndSpread = () => {
    const [a, b] = [...held.values()];
    return {
      x: (a.x + b.x) / 2,
      y: (a.y + b.y) / 2,
      spread: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)),
    };
  };

  element.addEventListener('pointerdown', (event) => {
    if (event.button > 2) return;
    element.setPointerCapture(event.pointerId);
    held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    element.classList.add('dragging');
  });

  element.addEventListener('pointermove', (event) => {
    const from = held.get(event.pointerId);
    if (!from || held.size > 2) return;
    const height = element.clientHeight || 1;
    const to = { x: event.clientX, y: event.clientY };
    if (held.size === 2) {
      const before = centreAndSpread();
      held.set(event.pointerId, to);
      const after = centreAndSpread();
      moves.pan((after.x - before.x) / height, (after.y - before.y) / height);
      moves.zoom(before.spread / after.spread);
      return;
    }
    held.set(event.pointerId, to);
    const right = (to.x - from.x) / height;
    const down = (to.y - from.y) / height;
    if (right === 0 && down === 0) return;
    if (event.shiftKey || (event.buttons & 6) !== 0) moves.pan(right, down);
    else moves.orbit(right * RADIANS_PER_HEIGHT, down * RADIANS_PER_HEIGHT);
  });

  const release = (event) => {
    held.delete(event.pointerId);
    if (held.size === 0) element.classList.remove('dragging');
  };
  element.addEventListener('pointerup', release);
  element.addEventListener('pointercancel', release);
  element.addEventListener('lostpointercapture', release);
  element.addEventListener('contextmenu', (event) => event.preventDefault());
  element.addEventListener('dblclick', () => moves.reset());

  element.addEventListener('wheel', (event) => {
    event.preventDefault();
    const unitPx = [1, WHEEL_LINE_PX, element.clientHeight][event.deltaMode];
    const px = Math.max(-MOST_WHEEL_PX, Math.min(MOST_WHEEL_PX, event.deltaY * unitPx));
    moves.zoom(Math.exp(px * WHEEL_ZOOM_PER_PX));
  }, { passive: false });
}
