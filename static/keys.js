// The page's keys. They stay out of the way of form controls, dialogs and the transfer function's points.

const ORBIT_RAD = (5 * Math.PI) / 180;
const PAN_FRACTION = 0.05;
const ZOOM_STEP = 1.15;

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * @param {{orbit(right, down), pan(right, down), zoom(factor), reset()}} moves
 * @param {{panel(): void, upload(): void, picture: HTMLElement}} page
 */
export function listenToKeys(moves, page) {
  const dialog = document.getElementById('keys');
  const showKeys = () => { if (!dialog.open) dialog.showModal(); };
  document.getElementById('help').addEventListener('click', showKeys);
  for (const [id, move] of [
    ['zoom-in', () => moves.zoom(1 / ZOOM_STEP)],
    ['zoom-out', () => moves.zoom(ZOOM_STEP)],
    ['reset-view', () => moves.reset()],
  ]) document.getElementById(id).addEventListener('click', move);

  document.addEventListener('keydown', (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (document.querySelector('dialog[open]')) return;
    const onPicture = event.target === page.picture;
    const idle = onPicture || event.target === document.body;
    if (!idle && event.target.closest('input, select, textarea, [contenteditable], #transfer')) return;
    if (act(event, idle)) event.preventDefault();
  });

  function act(event, idle) {
    const arrow = idle && ARROWS[event.key];
    if (arrow) {
      const [right, down] = arrow;
      // As a drag in that direction: the scene follows the arrow.
      if (event.shiftKey) moves.pan(right * PAN_FRACTION, down * PAN_FRACTION);
      else moves.orbit(right * ORBIT_RAD, down * ORBIT_RAD);
      return true;
    }
    switch (event.key) {
      case '+': case '=': moves.zoom(1 / ZOOM_STEP); return true;
      case '-': case '_': moves.zoom(ZOOM_STEP); return true;
      case '0': case 'r': case 'R': moves.reset(); return true;
      case 'c': case 'C': page.panel(); return true;
      case 'u': case 'U': page.upload(); return true;
      case '?': showKeys(); return true;
      default: return false;
    }
  }
}
