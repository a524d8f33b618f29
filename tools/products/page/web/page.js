// Starts the page: connects its controls, and runs the loop that steps the block and draws pictures.
'use strict';

function press(buttons, pressed) {
  for (const button of buttons) button.setAttribute('aria-pressed', String(button === pressed));
}

function choose(attribute, chosen) {
  const buttons = [...document.querySelectorAll(`[data-${attribute}]`)];
  for (const button of buttons)
    button.addEventListener('click', () => {
      press(buttons, button);
      chosen(button.dataset[attribute]);
    });
}

function compareHashes(library) {
  const here = library.goldenHashes();
  const equal = here.filter((hash, i) => hash === nativeHashes[i]).length;
  const verdict = document.getElementById('hash-verdict');
  verdict.textContent = `${equal} of ${nativeHashes.length} ${equal === nativeHashes.length ? '✓' : '✗'}`;
  verdict.classList.toggle('wrong', equal !== nativeHashes.length);
  return {here, native: nativeHashes};
}

/** Shows pictures and steps per second, as means over the last second. */
function makeMeter() {
  let pictures = 0, steps = 0, stepping = 0, since = performance.now();
  const meter = {picturesPerSecond: 0, stepMicroseconds: 0};
  meter.count = (now, newSteps, milliseconds) => {
    ++pictures;
    steps += newSteps;
    stepping += milliseconds;
    if (now - since < 1000) return;
    meter.picturesPerSecond = 1000 * pictures / (now - since);
    meter.stepMicroseconds = steps ? 1000 * stepping / steps : 0;
    document.getElementById('pictures').textContent = meter.picturesPerSecond.toFixed(0);
    document.getElementById('step-cost').textContent = steps ? `${meter.stepMicroseconds.toFixed(1)} µs` : '…';
    pictures = steps = stepping = 0;
    since = now;
  };
  return meter;
}

async function unpack(text) {
  const packed = new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]);
  return new Response(packed.stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
}

async function main() {
  const library = await openLibrary(await unpack(bristleWasm));
  const hashes = compareHashes(library);
  document.getElementById('version').textContent = `bristle ${library.version}`;

  let settings;
  const refusal = document.getElementById('refusal');
  const contactNote = document.getElementById('contact-note');
  const apply = () => {
    if (!settings) return;
    refusal.textContent = applySettings(library, settings.values);
    contactNote.textContent = {
      bristles: 'Each bristle bends and snaps by itself.',
      cohorts: 'Infinitely many bristles, as a list of cohorts: no noise.',
      slide: 'A bristle does not snap: bent by its snap length, it slides. After a slide all are bent, so the next peak is higher.',
    }[settings.values.contact];
  };
  settings = makeSettings(document.getElementById('sliders'), library.coefficients, apply);
  apply();

  const scene = makeScene();
  const glass = makeGlass();
  const curve = makeCurve();
  const trace = makeTrace();
  const hand = makeHand(library, scene);
  const meter = makeMeter();
  let speed = 1;

  const motions = {pull: document.getElementById('slow-pull'), rub: document.getElementById('rub')};
  for (const [motion, button] of Object.entries(motions)) button.addEventListener('click', () => hand.toggle(motion));
  hand.onOwner((owner) => press(Object.values(motions), motions[owner]));
  document.getElementById('start-over').addEventListener('click', () => {
    hand.letGo();
    library.reset();
    scene.startOver();
  });
  document.getElementById('defaults').addEventListener('click', () => settings.defaults());
  choose('speed', (value) => { speed = Number(value); });
  choose('range', (value) => { curve.range = value; });
  choose('contact', (value) => settings.setContact(value));

  let last = performance.now();
  let owed = 0;  // steps of 1 ms that are due but not yet done
  function picture(now) {
    // Limits the steps due, so that a machine too slow for real time runs slower instead of falling behind for ever.
    owed = Math.min(owed + (now - last) * speed, 50);
    last = now;
    const steps = Math.floor(owed);
    owed -= steps;
    hand.move(library.state(), settings.values);
    const begin = performance.now();
    library.step(steps);
    meter.count(now, steps, performance.now() - begin);
    const state = library.state();
    scene.draw(state, settings.values.spring);
    glass.draw(library, state, settings.values);
    curve.draw(library, state, settings.values);
    trace.draw(library, state, speed);
    requestAnimationFrame(picture);
  }
  requestAnimationFrame(picture);

  // Gives tools/upkeep/check_page, the page's test, access to the running page.
  window.bristlePage = {hashes, meter, settings, state: () => library.state(),
    blockOnScreen: () => scene.blockOnScreen(library.state())};
  window.bristlePage.compared = await runComparisons(library);
}

main().catch((error) => {
  document.getElementById('refusal').textContent = `The page could not start: ${error.message}`;
});
