// Opens a WebAssembly module of the library: gives it the few system calls that it needs, and turns refusals into errors.

/** Error of the library: its message says what was refused. */
export class Refusal extends Error {}

/** Returns the module's exports, as {wasm, text, guarded}: text(address) reads a C string; guarded(f) runs f, and restores
 *  the module's stack if the library throws a Refusal. */
export async function openModule(bytes) {
  let wasm;
  const text = (at) => {
    const all = new Uint8Array(wasm.memory.buffer);
    return new TextDecoder().decode(all.subarray(at, all.indexOf(0, at)));
  };
  const module = await WebAssembly.compile(bytes);
  // The library imports a clock and an empty environment; other system calls report that they are missing.
  const missing = 52;
  const system = {
    clock_time_get(id, precision, at) {
      new DataView(wasm.memory.buffer).setBigUint64(at, BigInt(Math.round(1e6 * performance.now())), true);
      return 0;
    },
    environ_sizes_get(count, bytes) {
      for (const at of [count, bytes]) new DataView(wasm.memory.buffer).setUint32(at, 0, true);
      return 0;
    },
    environ_get: () => 0,
  };
  const imports = {page: {refuse(at) { throw new Refusal(text(at)); }}};
  for (const {module: from, name} of WebAssembly.Module.imports(module))
    if (from !== 'page') (imports[from] ??= {})[name] = system[name] ?? (() => missing);
  wasm = (await WebAssembly.instantiate(module, imports)).exports;
  wasm._initialize();
  const guarded = (call) => {
    const stack = wasm.__stack_pointer.value;
    try {
      return call();
    } catch (error) {
      if (error instanceof Refusal) wasm.__stack_pointer.value = stack;
      throw error;
    }
  };
  return {wasm, text, guarded};
}
