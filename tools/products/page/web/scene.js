// Draws the block on the floor, the spring, the hand, and the forces as arrows.
'use strict';

const worldWidth = 0.09;   // width of the floor in the picture, m
const blockWidth = 0.018;  // m
const keepWithin = 0.026;  // distance from the picture's middle beyond which it follows the block, m

function makeScene() {
  const view = openCanvas('scene');
  let middle = 0;  // position on the floor at the picture's middle, m

  const pixelsPerMetre = () => view.width / worldWidth;
  const toScreen = (x) => view.width / 2 + (x - middle) * pixelsPerMetre();
  const floorLevel = () => view.height - 46;

  // Returns the height (0 to 1) of tooth number i of the drawn floor, a fixed pseudo-random number.
  function tooth(i) {
    const x = Math.sin(i * 127.1 + 11.7) * 43758.5453;
    return x - Math.floor(x);
  }

  function drawFloor(context) {
    const level = floorLevel();
    const pitch = 0.0009;
    context.beginPath();
    context.moveTo(0, view.height);
    const first = Math.floor((middle - worldWidth / 2) / pitch) - 1;
    const last = first + Math.ceil(worldWidth / pitch) + 3;
    for (let i = first; i <= last; ++i) context.lineTo(toScreen(i * pitch), level + 1 + 6 * tooth(i));
    context.lineTo(view.width, view.height);
    context.fillStyle = colours['floor-fill'];
    context.fill();
    context.strokeStyle = colours.floor;
    context.lineWidth = 1.2;
    context.stroke();
    for (let mm = Math.ceil((middle - worldWidth / 2) * 1e3); mm <= (middle + worldWidth / 2) * 1e3; ++mm) {
      const x = toScreen(mm * 1e-3);
      const long = mm % 10 === 0;
      stroke(context, [x, view.height - 22, x, view.height - (long ? 14 : 18)], colours.floor);
      if (long) label(context, mm === 0 ? '0 mm' : String(mm), x, view.height - 3, {align: 'center', size: 11});
    }
  }

  function drawBlock(context, state) {
    const width = blockWidth * pixelsPerMetre();
    const height = Math.min(74, view.height * 0.36);
    const left = toScreen(state.position) - width / 2;
    const top = floorLevel() - height;
    context.fillStyle = colours.block;
    context.strokeStyle = colours['block-edge'];
    context.lineWidth = 1.5;
    context.beginPath();
    context.roundRect(left, top, width, height, 5);
    context.fill();
    context.stroke();
    context.globalAlpha = 0.35;
    for (const share of [0.25, 0.5, 0.75]) {
      const y = top + height * share;
      const bow = 4 * Math.sin(9 * share);
      context.beginPath();
      context.moveTo(left + 5, y);
      context.quadraticCurveTo(left + width / 2, y + bow, left + width - 5, y - bow / 2);
      context.stroke();
    }
    context.globalAlpha = 1;
    return {left, top, width, height};
  }

  function drawSpring(context, from, to, y) {
    const turns = 9;
    const reach = Math.max(2.5, 9 - Math.abs(to - from) / 60);
    const points = [from, y];
    for (let i = 1; i < 2 * turns; ++i) points.push(from + (to - from) * i / (2 * turns), y + (i % 2 ? -reach : reach));
    points.push(to, y);
    context.lineJoin = 'round';
    stroke(context, points, colours.pull, 1.8);
    context.beginPath();
    context.arc(to, y, 9, 0, 2 * Math.PI);
    context.fillStyle = colours.pull;
    context.fill();
    context.strokeStyle = colours.card;
    context.lineWidth = 2;
    context.stroke();
  }

  return {
    canvas: view.canvas,
    /** Returns the position on the floor (m) under a pointer's clientX. */
    toWorld(clientX) {
      const box = view.canvas.getBoundingClientRect();
      return middle + (clientX - box.left - view.width / 2) / pixelsPerMetre();
    },
    /** Returns where the block's middle is on the screen, for test scripts. */
    blockOnScreen(state) {
      const box = view.canvas.getBoundingClientRect();
      return {x: box.left + toScreen(state.position), y: box.top + floorLevel() - 20};
    },
    startOver() { middle = 0; },
    draw(state, spring) {
      const context = view.context;
      middle = Math.max(state.position - keepWithin, Math.min(state.position + keepWithin, middle));
      clear(view);
      drawFloor(context);
      const start = toScreen(0);
      context.setLineDash([3, 3]);
      stroke(context, [start, 26, start, floorLevel()], colours.line);
      context.setLineDash([]);
      const box = drawBlock(context, state);
      const centre = toScreen(state.position);
      const newton = 90 / Math.max(state.peak, 1e-9) * Math.min(1, view.width / 700);
      arrow(context, centre, floorLevel() - 9, state.friction * newton, colours.friction);
      if (state.held) {
        const level = box.top - 16;
        stroke(context, [centre, box.top, centre, level - 6], colours['block-edge'], 4);
        drawSpring(context, centre, toScreen(state.hand), level);
      }
      const friction = Math.abs(state.friction);
      label(context, `moved ${lengthSigned(state.position)}`, 4, 16, {colour: colours.ink, size: 14, weight: '600'});
      label(context, `friction ${friction.toFixed(3)} N`, view.width - 4, 16,
        {colour: colours.friction, align: 'right', size: 14, weight: '600'});
      if (state.held) {
        const pull = spring * (state.hand - state.position);
        label(context, `spring ${Math.abs(pull).toFixed(3)} N`, view.width - 4, 36,
          {colour: colours.pull, align: 'right', size: 14, weight: '600'});
      } else {
        label(context, 'drag the block', centre, box.top - 10, {align: 'center', size: 13});
      }
    },
  };
}

function lengthSigned(metres) {
  const size = Math.abs(metres);
  const sign = metres < 0 ? '−' : '';
  if (size < 1e-8) return '0 µm';
  return size < 1e-3 ? `${sign}${(size * 1e6).toFixed(size < 1e-5 ? 2 : 1)} µm` : `${sign}${(size * 1e3).toFixed(2)} mm`;
}
