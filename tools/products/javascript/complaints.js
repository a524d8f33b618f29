// Runs three published complaints in MuJoCo and Rapier, with the engine's own friction and with bristles, and checks them.
// usage: node complaints.js    (beside bristle.wasm, after npm install)
import fs from 'node:fs';
import loadMujoco from '@mujoco/mujoco';
import rapier from '@dimforge/rapier3d-compat';
import {openBristle, Refusal} from './bristle.js';
import {structs} from './layout.js';
import {measure, openMujoco, openRapier, scenes} from './scenes.js';

let failed = 0;
function check(holds, what) {
  if (!holds) console.log(`FAIL  ${what}`);
  failed += holds ? 0 : 1;
}

const capsuleModel = fs.readFileSync(new URL('mujoco_capsule.xml', import.meta.url), 'utf8');
const bristle = await openBristle();
const mujoco = await loadMujoco();
await rapier.init();
const engines = {
  [`MuJoCo ${mujoco.mj_versionString()}`]: (scene, by) => openMujoco(mujoco, scene, by, capsuleModel),
  [`Rapier ${rapier.version()}`]: (scene, by) => openRapier(rapier, scene, by),
};
for (const type of Object.keys(structs)) bristle.records(type, 1);  // whose bristle_init_...() refuses another size
const refuses = (call) => {
  try {
    call();
  } catch (error) {
    return error instanceof Refusal && error.message.length > 10;
  }
};
const [wrong, material] = [bristle.struct('bristle_coefficients', {kinetic: -1}), bristle.struct('bristle_material')];
for (let i = 0; i < 1000; ++i)
  if (!refuses(() => bristle.c.bristle_material_from_coefficients(wrong.address, material.address))) check(i < 0, 'a negative coefficient is refused');
check(refuses(() => bristle.c.bristle_material_check(0)), 'a null pointer is refused');
console.log(`bristle ${bristle.text(bristle.c.bristle_version())}\n`);
for (const [engine, open] of Object.entries(engines)) {
  console.log(`${engine.padEnd(42)}${'own friction'.padStart(14)}${'bristles'.padStart(14)}`);
  for (const [name, scene] of Object.entries(scenes)) {
    const [own, ours] = [undefined, bristle].map((by) => measure(scene, open(scene, by)));
    const row = (what, factor, unit) => console.log(`  ${`${scene.title}: ${what}`.padEnd(66)}` +
      [own, ours].map((found) => (factor * found[what]).toFixed(4).padStart(14)).join('') + ` ${unit}`);
    const expected = {falling: 9.81 - 0.5 * 5, pair: 1 / 3}[name];  // m/s^2: by Coulomb's law, as one body
    if (expected) {
      row('acceleration', 1, 'm/s^2');
      check(Math.abs(ours.acceleration / expected - 1) < 0.005, `${engine}: ${scene.title} with ${expected.toFixed(4)} m/s^2`);
    } else {
      row('creep', 1e6, 'um/s');
      row('moved', 1e6, 'um');
      check(Math.abs(ours.creep) < 1e-8, `${engine}: ${scene.title} rests with bristles`);
    }
  }
}
process.exit(failed ? 1 : 0);
