// Types of bristle.js. The C interface's own types are in bristle_c.d.ts, made by describe_interface.
import type {Constant, Functions, Pointer, Structs} from './bristle_c.js';

export type {Constant, Functions, Pointer, Structs};
export declare const constants: Readonly<Record<Constant, number>>;

/** Error of the library: its message says what was refused. */
export declare class Refusal extends Error {}

/** Array of C structs in the module's memory, with their defaults. */
export interface Records<Struct> {
  readonly address: Pointer;
  readonly count: number;
  readonly size: number;
  at(i: number): Pointer;
  get<Field extends keyof Struct & string>(i: number, field: Field, k?: number): Struct[Field];
  set<Field extends keyof Struct & string>(i: number, field: Field, value: Struct[Field], k?: number): void;
}

export interface Bristle {
  /** The functions of bristle.h. A result other than BRISTLE_OK is thrown as a Refusal. */
  readonly c: Functions;
  readonly wasm: {readonly memory: WebAssembly.Memory; malloc(size: number): Pointer; free(address: Pointer): void};
  /** Reads a C string. */
  text(address: Pointer): string;
  /** Returns zeroed memory. */
  allocate(size: number): Pointer;
  records<Name extends keyof Structs>(type: Name, count: number): Records<Structs[Name]>;
  /** Makes one struct with some fields set. */
  struct<Name extends keyof Structs>(type: Name, values?: Partial<Structs[Name]>): Records<Structs[Name]>;
  /** Calls make(address) with a place for a handle, and returns what was written there; 'BigUint64' for a bristle_id. */
  made(make: (place: Pointer) => unknown): Pointer;
  made(make: (place: Pointer) => unknown, type: 'BigUint64'): bigint;
}

/** Opens the module. `bytes`: bristle.wasm; read from beside bristle.js if absent. */
export declare function openBristle(bytes?: BufferSource): Promise<Bristle>;
