// Wraps the WebAssembly library in plain functions. Lengths in metres, forces in newtons.
import {openModule, Refusal} from '../../javascript/open_module.js';

export async function openLibrary(bytes) {
  const {wasm, text, guarded} = await openModule(bytes);
  const memory = wasm.memory;
  const numbers = (at, count) => new Float64Array(memory.buffer, at, count);
  const fields = ['position', 'velocity', 'hand', 'held', 'friction', 'kinetic', 'peak', 'steps', 'bristles', 'active'];
  const coefficients = text(wasm.coefficients()).trim().split('\n').map((line) => {
    const [name, unit, meaning, least, most, first] = line.split('\t');
    return {name, unit, meaning, least: Number(least), most: Number(most), first: Number(first)};
  });
  return {
    version: text(wasm.version()),
    /** Numbers of the library's Coefficients, from its table of fields: name, unit, meaning, range, default. */
    coefficients,
    /** Returns the state hashes of scripted patches, in the order of tests/data/golden_hash.csv. */
    goldenHashes: () => text(wasm.golden_hashes()).trim().split(' '),
    /**
     * Applies settings, with coefficients by their names; those left out get their defaults. Returns an empty text, or the
     * error message of the library.
     */
    configure(contact, bristles, load, spring, named) {
      numbers(wasm.coefficient_values(), coefficients.length).set(coefficients.map(({name, first}) => named[name] ?? first));
      try {
        guarded(() => wasm.configure(contact, bristles, load, spring));
        return '';
      } catch (error) {
        if (!(error instanceof Refusal)) throw error;
        return error.message;
      }
    },
    reset: wasm.reset,
    grab: wasm.grab,
    moveHand: wasm.move_hand,
    release: wasm.release,
    step: wasm.step,
    remembered: wasm.samples_remembered(),
    state() {
      const values = numbers(wasm.state(), fields.length);
      return Object.fromEntries(fields.map((name, i) => [name, values[i]]));
    },
    /** Returns the ring buffer of samples (time, position, friction, spring force); i is at 4 (i mod remembered). */
    samples() { return numbers(wasm.samples(), 4 * this.remembered); },
    bends(count) { return numbers(wasm.bends(count), count); },
    /** Returns the names of the models in a comparison: 0 drift, 1 rubbing, 2 rolling. */
    comparedModels(comparison) {
      const names = [];
      for (let name; (name = text(wasm.compared_model(comparison, names.length)));) names.push(name);
      return names;
    },
    /** Runs a comparison with one of its models. Returns its judging number and its curve (x0, y0, x1, y1, ...). */
    compare(comparison, model) {
      const at = wasm.compare(comparison, model);
      const [finding, shown, count] = numbers(at, 3);
      return {finding, shown: shown === 1, points: numbers(at + 24, 2 * count).slice()};
    },
    /** Returns the time of a step of 10,000 sliding bristles, us. */
    stepMicroseconds: wasm.step_microseconds,
  };
}
