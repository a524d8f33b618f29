// Wraps the WebAssembly library in plain functions. Lengths in metres, forces in newtons.
'use strict';

/** Message of an exception of the library. */
class Refusal extends Error {}

async function openLibrary(bytes) {
  let memory;
  const text = (at) => {
    const all = new Uint8Array(memory.buffer);
    return new TextDecoder().decode(all.subarray(at, all.indexOf(0, at)));
  };
  const module = await WebAssembly.compile(bytes);
  // The library imports a clock and an empty environment; other system calls report that they are missing.
  const missing = 52;
  const system = {
    clock_time_get(id, precision, at) {
      new DataView(memory.buffer).setBigUint64(at, BigInt(Math.round(1e6 * performance.now())), true);
      return 0;
    },
    environ_sizes_get(count, bytes) {
      for (const at of [count, bytes]) new DataView(memory.buffer).setUint32(at, 0, true);
      return 0;
    },
    environ_get: () => 0,
  };
  const imports = {page: {refuse(at) { throw new Refusal(text(at)); }}};
  for (const {module: from, name} of WebAssembly.Module.imports(module))
    if (from !== 'page') (imports[from] ??= {})[name] = system[name] ?? (() => missing);
  const wasm = (await WebAssembly.instantiate(module, imports)).exports;
  memory = wasm.memory;
  wasm._initialize();

  const numbers = (at, count) => new Float64Array(memory.buffer, at, count);
  const fields = ['position', 'velocity', 'hand', 'held', 'friction', 'kinetic', 'peak', 'steps', 'bristles', 'active'];
  return {
    version: text(wasm.version()),
    instructionSet: text(wasm.instruction_set()),
    fixedSceneHash: () => text(wasm.fixed_scene_hash()),
    /** Applies settings. Returns an empty text, or the error message of the library. */
    configure(...settings) {
      const stack = wasm.__stack_pointer.value;
      try {
        wasm.configure(...settings);
        return '';
      } catch (error) {
        if (!(error instanceof Refusal)) throw error;
        wasm.__stack_pointer.value = stack;
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
