// Checks the library of the page in Node.js: its state hash against the native one, a refusal, and each comparison.
// usage: node tools/products/page/check.js BRISTLE_PAGE_WASM NATIVE_HASH
'use strict';
const fs = require('fs');
const path = require('path');
const vm = require('vm');

const [wasm, native] = process.argv.slice(2);
vm.runInThisContext(fs.readFileSync(path.join(__dirname, 'web/library.js'), 'utf8') + '\nglobalThis.open = openLibrary;');

let failed = 0;
function require_(holds, what) {
  console.log(`  ${holds ? 'ok  ' : 'FAIL'}  ${what}`);
  failed += holds ? 0 : 1;
}

open(fs.readFileSync(wasm)).then((library) => {
  const hash = library.fixedSceneHash();
  require_(hash === native, `state hash ${hash} as WebAssembly, ${native} native`);

  const settings = (kinetic) => [0, 1000, 1, 60, kinetic, 1.25 * kinetic, 0.5e-3, 0.1, 1, 0, 0.1];
  require_(library.configure(...settings(0.4)) === '', 'settings are taken');
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
});
