// Checks the library of the page in Node.js: its state hashes against those on record, a refusal, and each comparison.
// usage: node tools/products/page/check.mjs BRISTLE_PAGE_WASM GOLDEN_HASH_CSV
import fs from 'node:fs';
import {openLibrary} from './web/library.mjs';
import {slidersOf} from './web/settings.mjs';

const [wasm, golden] = process.argv.slice(2);
let failed = 0;
function require_(holds, what) {
  console.log(`  ${holds ? 'ok  ' : 'FAIL'}  ${what}`);
  failed += holds ? 0 : 1;
}

const library = await openLibrary(fs.readFileSync(wasm));
const native = fs.readFileSync(golden, 'utf8').trim().split('\n').slice(1).map((line) => line.split(',')[1]);
const here = library.goldenHashes();
require_(native.length > 20 && here.join() === native.join(), `the ${native.length} state hashes on record, as WebAssembly`);

const settings = (kinetic, contact = 0, spring = 60) => [contact, 1000, 1, spring,
  {kinetic, peak: 1.25 * kinetic, presliding_length: 0.5e-3, damping_per_newton: 2.7, stribeck_velocity: 0.02}];
require_(library.configure(...settings(0.4)) === '', 'settings are taken');
for (const slider of slidersOf(library.coefficients))
  require_(slider.low < slider.high && slider.first >= slider.low && slider.first <= slider.high && slider.help.length > 10,
    `slider ${slider.name}: ${slider.text(slider.low)} to ${slider.text(slider.high)}, at first ${slider.text(slider.first)}`);
for (let i = 0; i < 1000; ++i) {
  if (library.configure(...settings(-1)).length > 10) continue;
  require_(false, 'a negative coefficient is refused');
  break;
}
require_(Math.abs(library.state().kinetic - 0.4) < 1e-9, 'a thousand refusals leave the settings and the stack');
library.grab();
library.moveHand(0.03);
library.step(3000);
const now = library.state();
// Checks that the block rests where its friction, at most the peak of 0.5 N, holds the spring of 60 N/m.
require_(now.position > 0 && Math.abs(now.position - 0.03) < 0.5 / 60 + 1e-4, `the hand pulls the block: ${now.position} m`);

for (const [contact, name] of ['bristles', 'cohorts', 'sliding bristles'].entries()) {
  library.configure(...settings(0.4, contact, 600));
  library.reset();
  library.grab();
  let highest = 0;
  for (let i = 0; i < 450; ++i) {
    library.moveHand(4e-6 * i);
    library.step(1);
    highest = Math.max(highest, Math.abs(library.state().friction));
  }
  require_(Math.abs(highest - 0.5) < 0.01, `${name} reach the stated peak of 0.5 N at first loading: ${highest.toFixed(3)} N`);
}

// Models expected to show each comparison's phenomenon (Dupont 2002, Courtney-Pratt 1957, Carter 1926).
const shown = [{brush_rubbed: true, lugre: false, coulomb: false}, {brush_rubbed: true, lugre: true, brush_redraw: false},
  {bed: true, patch: false, coulomb: false}];
shown.forEach((models, comparison) => {
  library.comparedModels(comparison).forEach((model, i) => {
    const curve = library.compare(comparison, i);
    require_(curve.shown === models[model] && curve.points.length > 20 && curve.points.every(Number.isFinite),
      `comparison ${comparison}, ${model}: ${curve.finding}`);
  });
});
const us = library.stepMicroseconds();
require_(us > 0, `10,000 sliding bristles take ${us.toFixed(1)} us a step`);
process.exit(failed ? 1 : 0);
