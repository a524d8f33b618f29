// The C interface of bristle (core/include/bristle/bristle.h) in JavaScript. Lengths in metres, forces in newtons.
import {constants, results, structs} from './layout.js';
import {openModule, Refusal} from './open_module.js';

export {constants, Refusal};

const types = {double: ['Float64', 8], uint64_t: ['BigUint64', 8], int32_t: ['Int32', 4], uint32_t: ['Uint32', 4],
  size_t: ['Uint32', 4], uint8_t: ['Uint8', 1]};

/** Array of C structs in the module's memory, with their defaults. */
class Records {
  constructor(bristle, type, count) {
    const {size, fields} = structs[type];
    Object.assign(this, {bristle, fields, count, size, address: bristle.allocate(size * count)});
    const init = bristle.c[type.replace('bristle_', 'bristle_init_')];
    for (let i = 0; init && i < count; ++i) init(this.at(i), size);
  }
  at(i) { return this.address + this.size * i; }
  get(i, field, k = 0) { return this.access('get', i, field, k); }
  set(i, field, value, k = 0) { this.access('set', i, field, k, value); }
  access(verb, i, field, k, value) {
    const [type, place, length] = this.fields[field] ?? [];
    if (!(i >= 0 && i < this.count && k >= 0 && k < length)) throw new RangeError(`no ${field}[${k}] of record ${i}`);
    const [name, size] = types[type];
    const at = this.at(i) + place + k * size;
    const view = new DataView(this.bristle.wasm.memory.buffer);
    return verb === 'get' ? view[`get${name}`](at, true) : view[`set${name}`](at, value, true);
  }
}

/** Opens the module. `bytes`: bristle.wasm; read from beside this file if absent. */
export async function openBristle(bytes) {
  const {wasm, text, guarded} = await openModule(bytes ?? await readBeside('bristle.wasm'));
  const checked = new Set(results);
  const bristle = {wasm, text, c: {}};
  for (const [name, call] of Object.entries(wasm)) {
    if (!name.startsWith('bristle_')) continue;
    bristle.c[name] = (...given) => {
      const result = guarded(() => call(...given));
      if (checked.has(name) && result !== constants.BRISTLE_OK) throw new Refusal(text(wasm.bristle_last_error()));
      return result;
    };
  }
  bristle.allocate = (size) => {
    const address = wasm.malloc(size);
    if (!address) throw new RangeError(`no memory for ${size} bytes`);
    new Uint8Array(wasm.memory.buffer, address, size).fill(0);
    return address;
  };
  bristle.records = (type, count) => new Records(bristle, type, count);
  /** Makes one struct with some fields set; returns it as records of one. */
  bristle.struct = (type, values = {}) => {
    const one = bristle.records(type, 1);
    for (const [field, value] of Object.entries(values)) one.set(0, field, value);
    return one;
  };
  /** Calls make(address) with a place for a result of eight bytes; returns what was written there. */
  bristle.made = (make, type = 'Uint32') => {
    const place = bristle.allocate(8);
    make(place);
    const value = new DataView(wasm.memory.buffer)[`get${type}`](place, true);
    wasm.free(place);
    return value;
  };
  return bristle;
}

async function readBeside(name) {
  const url = new URL(name, import.meta.url);
  if (url.protocol !== 'file:') return (await fetch(url)).arrayBuffer();
  return (await import('node:fs/promises')).readFile(url);
}
