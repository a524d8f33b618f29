// Friction of bristles at the contacts of free bodies in MuJoCo and Rapier, whose own friction is switched off.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const plus = (a, b, factor = 1) => a.map((value, i) => value + factor * b[i]);
const scaled = (a, factor) => a.map((value) => value * factor);
const times = (m, a) => [0, 3, 6].map((row) => dot(m.slice(row, row + 3), a));
const transposed = (m) => [0, 3, 6, 1, 4, 7, 2, 5, 8].map((at) => m[at]);

// A body is {position, rotation, velocity, spin} of its centre of mass; matrices are nine numbers, by rows. One that friction
// `moves` has in addition mass, inertia (in world axes) and external, the other forces and torques on it as six numbers.
const toWorld = (body, place) => plus(body.position, times(body.rotation, place));
const toBody = (body, point) => times(transposed(body.rotation), plus(point, body.position, -1));
const velocityAt = (body, point) => plus(body.velocity, cross(body.spin, plus(point, body.position, -1)));

/** Solves A x = b by elimination, A symmetric and positive definite. Overwrites both; returns b, which then is x. */
function solve(A, b) {
  const n = b.length;
  for (let i = 0; i < n; ++i)
    for (let j = i + 1; j < n; ++j) {
      const factor = A[j][i] / A[i][i];
      for (let k = i; k < n; ++k) A[j][k] -= factor * A[i][k];
      b[j] -= factor * b[i];
    }
  for (let i = n - 1; i >= 0; --i) {
    for (let k = i + 1; k < n; ++k) b[i] -= A[i][k] * b[k];
    b[i] /= A[i][i];
  }
  return b;
}

/** Patches of bristles of one material for all contacts of a scene. */
export class BristleFriction {
  /** `law`: fields of bristle_coefficients. `capacity`: contacts at a time; find() throws for one more. */
  constructor(bristle, law, capacity = 64, maxNormalLoad = 60) {
    const {c} = bristle;
    const material = bristle.struct('bristle_material').address;
    c.bristle_material_from_coefficients(
      bristle.struct('bristle_coefficients', {presliding_length: 20e-6, damping_per_newton: 0.5, ...law}).address, material);
    const patch = bristle.struct('bristle_patch_options', {max_normal_load: maxNormalLoad}).address;
    const pool = bristle.struct('bristle_keyed_options', {capacity}).address;
    const match = bristle.struct('bristle_matcher_options', {capacity}).address;
    const batch = bristle.made((place) => c.bristle_create(0, place));
    Object.assign(this, {
      bristle, batch, capacity,
      patches: bristle.made((place) => c.bristle_keyed_create(batch, material, patch, pool, place)),
      matcher: bristle.made((place) => c.bristle_matcher_create(match, place)),
      points: bristle.records('bristle_contact_point', capacity),
      motions: bristle.records('bristle_motion', capacity),
      responses: bristle.records('bristle_response', capacity),
      keys: bristle.allocate(8 * capacity),
      ids: bristle.allocate(8 * capacity),
      known: new Map(),  // by key: the contact's place in both bodies, and a direction along its surface
    });
    c.bristle_warm_up(batch);
  }

  /** Moves the patches by what the bodies moved since the last call, and returns the friction (N, world axes) on `mover` of
   *  each contact {pair, mover, base, point, normal, load} over the next step of dt (s). `normal` points to the mover. */
  find(dt, contacts) {
    const {c} = this.bristle;
    if (contacts.length > this.capacity) throw new RangeError(`${contacts.length} contacts, and room for ${this.capacity}`);
    const arrays = [this.motions.address, this.motions.size, this.responses.address, this.responses.size, contacts.length];
    this.match(contacts);
    c.bristle_step(this.batch, dt, ...arrays, 0);
    this.predict(dt, contacts);
    c.bristle_find_force(this.batch, dt, ...arrays);
    return contacts.map(({along, aside}, i) =>
      plus(scaled(along, this.responses.get(i, 'end', 0)), aside, this.responses.get(i, 'end', 1)));
  }

  /** Gives each contact its patch, the axes of that, and the motion since the last call. */
  match(contacts) {
    const {c, wasm} = this.bristle;
    contacts.forEach((contact, i) => {
      this.points.set(i, 'pair', BigInt(contact.pair));
      toBody(contact.mover, contact.point).forEach((value, k) => this.points.set(i, 'point', value, k));
    });
    c.bristle_matcher_match(this.matcher, this.points.address, this.keys, contacts.length, 0);
    c.bristle_keyed_find_or_add(this.patches, this.keys, this.ids, contacts.length);
    c.bristle_keyed_end_step(this.patches);
    const [keys, ids] = [this.keys, this.ids].map((at) => new BigUint64Array(wasm.memory.buffer, at, contacts.length));
    this.known = new Map(contacts.map((contact, i) => {
      const {mover, base, point, normal, load} = contact;
      const before = this.known.get(keys[i]);
      // A new contact takes the axis that is farthest from the normal; later ones turn it with the normal.
      const sizes = normal.map(Math.abs);
      const wanted = before?.along ?? sizes.map((size, axis) => axis === sizes.indexOf(Math.min(...sizes)) ? 1 : 0);
      const along = plus(wanted, normal, -dot(wanted, normal));
      contact.along = scaled(along, 1 / Math.hypot(...along));
      contact.aside = cross(normal, contact.along);
      const slip = before ? plus(toWorld(mover, before.inMover), toWorld(base, before.inBase), -1) : [0, 0, 0];
      [contact.along, contact.aside].forEach((axis, k) => this.motions.set(i, 'displacement', dot(axis, slip), k));
      this.motions.set(i, 'id', ids[i]);
      this.motions.set(i, 'normal_load', load);
      return [keys[i], {inMover: toBody(mover, point), inBase: toBody(base, point), along: contact.along}];
    }));
  }

  /** Predicts the slip of all contacts in the next step. Each contact pushes its two bodies apart along three axes with
   *  force - resistance (relative velocity J v): friction by stiffness and damping, the normal force so stiffly that the
   *  surfaces stay together. The velocities v of the free bodies follow from M (v - v0) = dt (external + sum of J^T of these). */
  predict(dt, contacts) {
    const bodies = [...new Set(contacts.flatMap(({mover, base}) => [mover, base]))].filter((body) => body.moves);
    const size = 6 * bodies.length;
    const A = Array.from({length: size}, () => new Array(size).fill(0));
    const b = bodies.flatMap(({mass, inertia, velocity, spin, external}, n) => {
      [0, 1, 2].forEach((r) => {
        A[6 * n + r][6 * n + r] = mass;
        [0, 1, 2].forEach((s) => { A[6 * n + 3 + r][6 * n + 3 + s] = inertia[3 * r + s]; });
      });
      return plus([...scaled(velocity, mass), ...times(inertia, spin)], external, dt);
    });
    const slips = [];
    contacts.forEach(({mover, base, point, along, aside, normal, load}, i) => {
      const tangent = dt * this.responses.get(i, 'stiffness') + this.responses.get(i, 'damping');
      const ground = base.moves ? [0, 0, 0] : velocityAt(base, point);
      [along, aside, normal].forEach((axis, k) => {
        const row = [];  // entries of J that are not 0: [column, value]
        for (const [body, sign] of [[mover, 1], [base, -1]])
          if (body.moves) [...axis, ...cross(plus(point, body.position, -1), axis)].forEach((value, j) =>
            row.push([6 * bodies.indexOf(body) + j, sign * value]));
        const [force, resistance] = k < 2 ? [this.responses.get(i, 'elastic', k), tangent] : [load, 100 * mover.mass / dt];
        for (const [r, value] of row) {
          b[r] += dt * value * (force + resistance * dot(axis, ground));
          for (const [s, other] of row) A[r][s] += dt * resistance * value * other;
        }
        if (k < 2) slips.push([i, k, row, dot(axis, ground)]);
      });
    });
    const v = solve(A, b);
    for (const [i, k, row, still] of slips)
      this.motions.set(i, 'displacement', dt * (row.reduce((sum, [r, value]) => sum + value * v[r], 0) - still), k);
  }
}

/** Makes a contact from what an engine lists; `normal` points from the first body to the second. */
function makeContact(pair, first, second, point, normal, load) {
  if (second.moves) return {pair, mover: second, base: first, point, normal, load};
  if (first.moves) return {pair, mover: first, base: second, point, normal: scaled(normal, -1), load};
  throw new Error('bristles act between a free body and another; neither of these two is free');
}

/** Calls push(body, force, point) for each contact's friction: on its mover, and the opposite on its base. */
function pushAll(contacts, forces, push) {
  contacts.forEach(({mover, base, point}, i) => {
    push(mover, forces[i], point);
    push(base, scaled(forces[i], -1), point);
  });
}

/** Returns a function that makes the value of a key once. */
function once(make) {
  const made = new Map();
  return (key, ...given) => {
    if (!made.has(key)) made.set(key, make(key, ...given));
    return made.get(key);
  };
}

/** Switches off MuJoCo's own friction; then stepMujoco() replaces mj_step. */
export function removeMujocoFriction(model) { model.geom_condim.fill(1); }

/** Steps MuJoCo (Euler's integrator) with bristles at the contacts of bodies with a free joint. */
export function stepMujoco(mujoco, model, data, friction) {
  mujoco.mj_forward(model, data);
  const given = data.xfrc_applied.slice();
  const body = once((id) => readMujocoBody(model, data, id, given));
  const contacts = [];
  const listed = data.contact;
  for (let i = 0; i < listed.size(); ++i) {
    const found = listed.get(i);
    if (found.efc_address >= 0)
      contacts.push(makeContact(found.geom1 * model.ngeom + found.geom2, body(model.geom_bodyid[found.geom1]),
        body(model.geom_bodyid[found.geom2]), Array.from(found.pos), Array.from(found.frame.slice(0, 3)),
        data.efc_force[found.efc_address]));
    found.delete();
  }
  listed.delete();
  const applied = data.xfrc_applied;
  pushAll(contacts, friction.find(model.opt.timestep, contacts), ({id, position}, force, point) =>
    [...force, ...cross(plus(point, position, -1), force)].forEach((value, k) => { applied[6 * id + k] += value; }));
  mujoco.mj_step2(model, data);
  data.xfrc_applied.set(given);
}

function readMujocoBody(model, data, id, given) {
  const numbers = (array, i, n) => Array.from(array.subarray(n * i, n * (i + 1)));
  const position = numbers(data.xipos, id, 3), rotation = numbers(data.ximat, id, 9);
  const principal = numbers(model.body_inertia, id, 3);
  // cvel holds the spin, and the velocity at the centre of mass of the body's whole tree.
  const motion = numbers(data.cvel, id, 6), spin = motion.slice(0, 3);
  const arm = plus(position, numbers(data.subtree_com, model.body_rootid[id], 3), -1);
  const mass = model.body_mass[id];
  return {id, position, rotation, spin, mass, velocity: plus(motion.slice(3), cross(spin, arm)), moves: model.body_dofnum[id] === 6,
    inertia: [0, 3, 6].flatMap((row) =>  // R diag(principal) R^T
      times(rotation, rotation.slice(row, row + 3).map((value, k) => value * principal[k]))),
    external: plus(numbers(given, id, 6), [...scaled(Array.from(model.opt.gravity), mass), 0, 0, 0])};
}

export const numbers = ({x, y, z}) => [x, y, z];
export const vector = ([x, y, z]) => ({x, y, z});
/** Returns the matrix of a quaternion. */
function matrix({x, y, z, w}) {
  const s = 2 / (x * x + y * y + z * z + w * w);
  return [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w),
    s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w),
    s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)];
}

/** Steps Rapier with bristles at the contacts of dynamic bodies that can turn. All colliders have friction 0. */
export function stepRapier(world, friction) {
  const body = once((handle, parent) => readRapierBody(parent, world.gravity));
  const bodyOf = (collider) => body(collider.parent()?.handle, collider.parent());
  const contacts = [];
  const colliders = [];
  world.forEachCollider((collider) => colliders.push(collider));
  colliders.forEach((one, first) => world.contactPairsWith(one, (other) => {
    const second = colliders.findIndex((collider) => collider.handle === other.handle);
    if (second < first) return;
    world.contactPair(one, other, (manifold, flipped) => {
      const normal = scaled(numbers(manifold.normal()), flipped ? -1 : 1);
      // Takes the point on the body that moves: Rapier keeps it while that body shifts by little.
      const secondMoves = bodyOf(other).moves;
      const shape = secondMoves ? other : one;
      const place = {position: numbers(shape.translation()), rotation: matrix(shape.rotation())};
      for (let i = 0; i < manifold.numContacts(); ++i) {
        const local = secondMoves !== flipped ? manifold.localContactPoint2(i) : manifold.localContactPoint1(i);
        contacts.push(makeContact(first * colliders.length + second, bodyOf(one), bodyOf(other), toWorld(place, numbers(local)),
          normal, manifold.contactImpulse(i) / world.timestep));
      }
    });
  }));
  const pushed = new Map();
  pushAll(contacts, friction.find(world.timestep, contacts), ({parent, given}, force, point) => {
    if (!parent?.isDynamic()) return;
    pushed.set(parent, given);
    parent.addForceAtPoint(vector(force), vector(point), true);
  });
  world.step();
  for (const [parent, given] of pushed) {
    parent.resetForces(false);
    parent.resetTorques(false);
    parent.addForce(vector(given.slice(0, 3)), false);
    parent.addTorque(vector(given.slice(3)), false);
  }
}

function readRapierBody(parent, gravity) {
  if (!parent) return {position: [0, 0, 0], rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1], velocity: [0, 0, 0], spin: [0, 0, 0]};
  const [xx, xy, xz, yy, yz, zz] = parent.effectiveAngularInertia().elements;
  const given = [...numbers(parent.userForce()), ...numbers(parent.userTorque())];
  const mass = parent.mass();
  return {parent, given, mass, position: numbers(parent.worldCom()), rotation: matrix(parent.rotation()),
    velocity: numbers(parent.linvel()), spin: numbers(parent.angvel()), inertia: [xx, xy, xz, xy, yy, yz, xz, yz, zz],
    moves: parent.isDynamic() && parent.effectiveWorldInvInertia().elements[0] > 0,
    external: plus(given, [...scaled(numbers(gravity), mass * parent.gravityScale()), 0, 0, 0])};
}
