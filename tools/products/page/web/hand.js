// Moves the hand by a pointer, by arrow keys, or in a motion of its own.
'use strict';

function makeHand(library, scene) {
  const pullSpeed = 0.004;  // m/s
  const keyStep = 0.001;     // distance that a key press moves the hand, m
  let owner = null;         // what moves the hand: null, 'pointer', 'keys', 'pull' or 'rub'
  let wanted = 0;
  let offset = 0;
  let began = 0;            // simulated time at which the hand's own motion began, s
  let listener = () => {};

  function take(by, time) {
    owner = by;
    library.grab();
    wanted = library.state().position;
    began = time;
    scene.canvas.classList.toggle('holding', by === 'pointer');
    listener(owner);
  }
  function letGo() {
    owner = null;
    library.release();
    scene.canvas.classList.remove('holding');
    listener(owner);
  }
  const now = () => library.state().steps * 1e-3;

  scene.canvas.addEventListener('pointerdown', (event) => {
    scene.canvas.setPointerCapture(event.pointerId);
    take('pointer', now());
    offset = wanted - scene.toWorld(event.clientX);
  });
  scene.canvas.addEventListener('pointermove', (event) => {
    if (owner !== 'pointer') return;
    wanted = scene.toWorld(event.clientX) + offset;
    library.moveHand(wanted);
  });
  for (const end of ['pointerup', 'pointercancel'])
    scene.canvas.addEventListener(end, () => { if (owner === 'pointer') letGo(); });
  scene.canvas.addEventListener('keydown', (event) => {
    const move = {ArrowLeft: -keyStep, ArrowRight: keyStep}[event.key];
    if (move) {
      if (owner !== 'keys') take('keys', now());
      wanted += move;
      library.moveHand(wanted);
      event.preventDefault();
    } else if (event.key === 'Escape') {
      letGo();
    }
  });

  return {
    onOwner(callback) { listener = callback; },
    /** Starts a motion of its own, or ends it. */
    toggle(motion) { owner === motion ? letGo() : take(motion, now()); },
    letGo,
    /** Before the steps of a picture. */
    move(state, settings) {
      const time = state.steps * 1e-3 - began;
      if (owner === 'pull') {
        if (time === 0) began = state.steps * 1e-3;
        library.moveHand(wanted + pullSpeed * time);
      } else if (owner === 'rub') {
        const reach = 1.15 * state.peak / settings.spring + 2 * settings.presliding_length;
        library.moveHand(wanted + reach * Math.sin(2 * Math.PI * time / 1.6));
      }
    },
  };
}
