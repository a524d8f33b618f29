// Three published complaints about friction as scenes for MuJoCo and Rapier, each with the engine's own friction or bristles.
import {BristleFriction, numbers, removeMujocoFriction, stepMujoco, stepRapier, vector} from './engines.js';

const slope = 15 * Math.PI / 180;
const pulled = [9.81 * Math.sin(slope), 0, -9.81 * Math.cos(slope)];  // gravity on the slope, m/s^2
const cube = {friction: 1, gravity: [0, 0, -9.81], down: [0, 0, -1], fixed: {size: [0.05, 1, 1], position: [-0.05, 0, 0]},
  body: {size: [0.05, 0.05, 0.05], position: [0.05, 0, 0], mass: 1}, dt: 0.01, option: ''};

/** `down`: direction in which the body is expected to creep. `force(t)`: on the body, N. `rate`: what is measured. */
export const scenes = {
  capsule: {title: 'capsule of 45 g between two pads', dt: 0.002, friction: 0.7, gravity: [0, 0, -9.81], down: [0, 0, -1],
    pads: {size: [0.008, 0.03, 0.02], away: 0.0125, mass: 0.2, force: 5.6, damping: 100},
    body: {radius: 0.004, half: 0.02, position: [0, 0, 0], mass: 0.045}, force: () => [0, 0, 0], settled: 0.5, seconds: 2.5},
  cube: {...cube, title: 'cube of 1 kg pressed to a wall with 20 N', force: () => [-20, 0, 0], settled: 1.5, seconds: 3},
  book: {title: 'book of 200 g on 15 degrees, tapped for 2 s', dt: 0.002, friction: 0.5, gravity: pulled, down: [1, 0, 0],
    fixed: {size: [5, 5, 0.5], position: [0, 0, -0.5]}, body: {size: [0.05, 0.05, 0.02], position: [0, 0, 0.02], mass: 0.2},
    option: 'cone="elliptic" impratio="10"', settled: 0.5, seconds: 6.5,
    force: (t) => t < 2.5 && t > 0.5 && t % 0.2 < 0.01 ? [0, 0.3, -1] : [0, 0, 0]},
  falling: {...cube, title: 'the cube pressed with 5 N, friction 0.5, falls', friction: 0.5, force: () => [-5, 0, 0], settled: 0.1, seconds: 0.4},
  pair: {title: 'cube of 1 kg pulled with 1 N on a free plate of 2 kg, both move', dt: 0.01, option: '', friction: 0.5, gravity: [0, 0, 0],
    down: [1, 0, 0], fixed: {size: [2, 2, 0.05], position: [0, 0, -0.05], mass: 2}, fixedForce: [0, 0, 5],
    body: {size: [0.05, 0.05, 0.05], position: [0, 0, 0.05], mass: 1}, force: () => [1, 0, -5], settled: 0.1, seconds: 0.4},
};

/** Returns a running scene, {time, step(), sunk()}: the place of its body along `down` (m). Without `bristle`, the engine's
 *  own friction acts. `capsuleModel`: text of tools/examples/mujoco_capsule.xml. */
export function openMujoco(mujoco, scene, bristle, capsuleModel) {
  const model = mujoco.MjModel.from_xml_string(scene.pads ? capsuleModel : boxModel(scene));
  const data = new mujoco.MjData(model);
  if (model.nkey) mujoco.mj_resetDataKeyframe(model, data, 0);
  const id = model.nbody - 1;
  const friction = bristle && new BristleFriction(bristle, {kinetic: scene.friction, peak: 1.15 * scene.friction});
  if (bristle) removeMujocoFriction(model);
  return {
    get time() { return data.time; },
    sunk: () => scene.down.reduce((sum, d, k) => sum + d * data.qpos[model.nq - 7 + k], 0),
    step() {
      scene.force(data.time).forEach((value, k) => { data.xfrc_applied[6 * id + k] = value; });
      scene.fixedForce?.forEach((value, k) => { data.xfrc_applied[6 + k] = value; });
      if (bristle) stepMujoco(mujoco, model, data, friction);
      else mujoco.mj_step(model, data);
    },
  };
}

function boxModel({dt, option, gravity, friction, fixed, body}) {
  const box = ({size, mass}) => `<geom type="box" size="${size.join(' ')}" ${mass ? `mass="${mass}"` : ''} friction="${friction}"/>`;
  return `<mujoco><option timestep="${dt}" ${option} gravity="${gravity.join(' ')}"/><worldbody>
    <body pos="${fixed.position.join(' ')}">${fixed.mass ? '<freejoint/>' : ''}${box(fixed)}</body>
    <body pos="${body.position.join(' ')}"><freejoint/>${box(body)}</body></worldbody></mujoco>`;
}

export function openRapier(rapier, scene, bristle) {
  const {RigidBodyDesc, ColliderDesc} = rapier;
  const world = new rapier.World(vector(scene.gravity));
  world.timestep = scene.dt;
  const add = (desc, collider, mass) => {
    const body = world.createRigidBody(desc.setCanSleep(false));  // a body that sleeps would hide its creep
    world.createCollider(collider.setFriction(bristle ? 0 : scene.friction).setMass(mass), body);
    return body;
  };
  const {size, radius, half, mass, position} = scene.body;
  const body = add(RigidBodyDesc.dynamic().setTranslation(...position),
    size ? ColliderDesc.cuboid(...size) : ColliderDesc.capsule(half, radius), mass);
  const {pads, fixed} = scene;
  const base = fixed && add((fixed.mass ? RigidBodyDesc.dynamic() : RigidBodyDesc.fixed()).setTranslation(...fixed.position),
    ColliderDesc.cuboid(...fixed.size), fixed.mass ?? 1);
  if (scene.fixedForce) base.addForce(vector(scene.fixedForce), true);
  for (const side of pads ? [-1, 1] : []) {
    const pad = add(RigidBodyDesc.dynamic().setTranslation(side * pads.away, 0, 0).enabledTranslations(true, false, false)
      .lockRotations().setLinearDamping(pads.damping / pads.mass), ColliderDesc.cuboid(...pads.size), pads.mass);
    pad.addForce({x: -side * pads.force, y: 0, z: 0}, true);
  }
  const friction = bristle && new BristleFriction(bristle, {kinetic: scene.friction, peak: 1.15 * scene.friction});
  let steps = 0;
  return {
    get time() { return steps * world.timestep; },
    sunk: () => numbers(body.translation()).reduce((sum, value, k) => sum + value * scene.down[k], 0),
    step() {
      body.resetForces(true);
      body.addForce(vector(scene.force(this.time)), true);
      if (bristle) stepRapier(world, friction);
      else world.step();
      ++steps;
    },
  };
}

/** Runs a scene to its end. Returns how fast its body sinks (m/s) over the last half of the time after it has settled, and
 *  how far it sank (m) and by how much its speed grew a second (m/s^2) since it had settled. */
export function measure(scene, running) {
  const stations = [scene.settled, 0.5 * (scene.settled + scene.seconds), scene.seconds].map((time) => {
    while (running.time < time - 1e-9) running.step();
    return {time: running.time, sunk: running.sunk()};
  });
  const [first, second] = [0, 1].map((i) => (stations[i + 1].sunk - stations[i].sunk) / (stations[i + 1].time - stations[i].time));
  return {creep: second, moved: stations[2].sunk - stations[0].sunk,
    acceleration: 2 * (second - first) / (stations[2].time - stations[0].time)};
}
