// Wraps the WebAssembly library in plain functions. Lengths in metres, forces in newtons.
'use strict';

async function openLibrary() {
  const wasm = await loadBristle();
  const call = (name, result, inputs) => wasm.cwrap(name, result, inputs);
  const stateAt = call('state', 'number', []);
  const samplesAt = call('samples', 'number', []);
  const bendsAt = call('bends', 'number', ['number']);
  const numbers = (at, count) => wasm.HEAPF64.subarray(at / 8, at / 8 + count);
  const fields = ['position', 'velocity', 'hand', 'held', 'friction', 'kinetic', 'peak', 'steps', 'bristles', 'active'];
  return {
    version: call('version', 'string', [])(),
    instructionSet: call('instruction_set', 'string', [])(),
    fixedSceneHash: call('fixed_scene_hash', 'string', []),
    /** Applies settings. Returns an empty text, or the error message of the library. */
    configure: call('configure', 'string', Array(11).fill('number')),
    reset: call('reset', null, []),
    grab: call('grab', null, []),
    moveHand: call('move_hand', null, ['number']),
    release: call('release', null, []),
    step: call('step', null, ['number']),
    remembered: call('samples_remembered', 'number', [])(),
    state() {
      const values = numbers(stateAt(), fields.length);
      return Object.fromEntries(fields.map((name, i) => [name, values[i]]));
    },
    /** Returns the ring buffer of samples (time, position, friction, spring force); i is at 4 (i mod remembered). */
    samples() { return numbers(samplesAt(), 4 * this.remembered); },
    bends(count) { return numbers(bendsAt(count), count); },
  };
}
