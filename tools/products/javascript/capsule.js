// Runs the capsule twice in MuJoCo, with its own friction and with bristles, and draws both beside each other.
import loadMujoco from '@mujoco/mujoco';
import {openBristle} from './bristle.js';
import {openMujoco, scenes} from './scenes.js';

const scene = scenes.capsule;
const longest = 60;  // s, after which both start again

function drawCapsule(view, sunk, rate) {
  const {context, width, height} = view;
  const scale = height / 0.03;  // pixels per metre
  const x = width / 2, y = height / 2;
  const radius = scene.body.radius * scale;
  clear(view);
  context.fillStyle = colours['floor-fill'];
  context.strokeStyle = colours.floor;
  for (const side of [-1, 1]) {
    const pad = [x + side * radius, 0.1 * height, side * 2 * scene.pads.size[0] * scale, 0.8 * height];
    context.fillRect(...pad);
    context.strokeRect(...pad);
  }
  context.setLineDash([4, 4]);
  stroke(context, [x - 3 * radius, y, x + 3 * radius, y], colours.soft);
  context.setLineDash([]);
  context.beginPath();
  context.arc(x, y + sunk * scale, radius, 0, 2 * Math.PI);
  context.fillStyle = colours.block;
  context.strokeStyle = colours['block-edge'];
  context.fill();
  context.stroke();
  stroke(context, [x - radius, y + sunk * scale, x + radius, y + sunk * scale], colours['block-edge']);
  label(context, `sunk ${tickText(1e6 * sunk, 0.1)} µm`, 8, 18, {colour: colours.ink, size: 14, weight: '600'});
  label(context, `${tickText(1e6 * rate, 0.1)} µm/s`, width - 8, 18, {colour: colours.ink, size: 14, weight: '600', align: 'right'});
}

/** Runs one capsule: advances it to a time (s), and keeps where it was each 50 ms since the pads have closed. */
function follow(open, canvas, colour) {
  const view = openCanvas(canvas);
  let running, start, samples;
  const it = {
    colour,
    begin() { [running, start, samples] = [open(), 0, []]; },
    advance(time) {
      for (; running.time < time; running.step()) {
        if (running.time < scene.settled) start = running.sunk();
        else if (running.time >= scene.settled + 0.05 * samples.length) samples.push(running.time, running.sunk() - start);
      }
    },
    samples: () => samples,
    sunk: () => running.sunk() - start,
    /** Returns the mean speed of the last second (m/s). */
    rate: () => samples.length < 42 ? 0 : (samples.at(-1) - samples.at(-41)) / (samples.at(-2) - samples.at(-42)),
    draw() { drawCapsule(view, it.sunk(), it.rate()); },
  };
  it.begin();
  return it;
}

async function main() {
  const [model, mujoco, bristle] = await Promise.all(
    [fetch('mujoco_capsule.xml').then((answer) => answer.text()), loadMujoco(), openBristle()]);
  const both = [['own', undefined, 'pull'], ['bristles', bristle, 'friction']].map(([canvas, by, colour]) =>
    follow(() => openMujoco(mujoco, scene, by, model), canvas, colour));
  const plot = openCanvas('sunk');
  const axes = makeAxes(plot, 'mm');
  let time = 0, last = performance.now();
  function picture(now) {
    time += Math.min(0.05, 1e-3 * (now - last));
    last = now;
    if (time > longest) {
      time = 0;
      for (const one of both) one.begin();
    }
    for (const one of both) one.advance(time);
    for (const one of both) one.draw();
    const most = Math.max(1, ...both.map((one) => 1e3 * one.sunk()));
    Object.assign(axes, {x0: 0, x1: Math.max(10, time), y0: -0.1 * most, y1: 1.1 * most});
    axes.draw('s', 1);
    axes.inside(() => both.forEach((one) => stroke(plot.context,
      one.samples().map((value, i) => i % 2 ? axes.y(1e3 * value) : axes.x(value)), colours[one.colour], 2)));
    requestAnimationFrame(picture);
  }
  requestAnimationFrame(picture);
  // Gives tools/upkeep/check_page access to the running page.
  window.capsulePage = {time: () => time, rates: () => both.map((one) => one.rate())};
}

main().catch((error) => {
  document.getElementById('refusal').textContent = `The page could not start: ${error.message}`;
});
