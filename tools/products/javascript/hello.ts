// The README's first program, as TypeScript and JavaScript: a block is pulled by 100 um, then its friction is printed.
import {openBristle} from './bristle.js';

const bristle = await openBristle();
const {c} = bristle;
const material = bristle.struct('bristle_material');
c.bristle_material_from_coefficients(bristle.struct('bristle_coefficients', {presliding_length: 20e-6 /* m */}).address, material.address);
const batch = bristle.made((place) => c.bristle_create(0, place));
const options = bristle.struct('bristle_patch_options', {max_normal_load: 2 /* N */});
const motion = bristle.struct('bristle_motion', {normal_load: 1 /* N */,
  id: bristle.made((place) => c.bristle_add(batch, material.address, options.address, place), 'BigUint64')});
const response = bristle.struct('bristle_response');
motion.set(0, 'displacement', 2e-6 /* m */, 0);
for (let step = 1; step <= 100; ++step) {
  c.bristle_step(batch, 1e-3 /* s */, motion.address, motion.size, response.address, response.size, 1, 0);
  if (step % 20 === 0) console.log(`${2 * step} um  ${response.get(0, 'end', 0).toFixed(3)} N`);
}
