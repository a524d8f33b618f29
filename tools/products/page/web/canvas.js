// Fits the sizes of canvases to their places on the screen, and reads the colours of the style sheet.
'use strict';

function openCanvas(id) {
  const canvas = document.getElementById(id);
  const context = canvas.getContext('2d', {alpha: false});
  const it = {canvas, context, width: 0, height: 0};
  const fit = () => {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const box = canvas.getBoundingClientRect();
    it.width = box.width;
    it.height = box.height;
    canvas.width = Math.max(1, Math.round(box.width * ratio));
    canvas.height = Math.max(1, Math.round(box.height * ratio));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    clear(it);  // a resized canvas is black until the next picture is drawn
  };
  new ResizeObserver(fit).observe(canvas);
  fit();
  return it;
}

let colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ['card', 'ink', 'soft', 'line', 'friction', 'pull', 'kinetic', 'peak', 'block', 'block-edge',
                      'floor', 'floor-fill', 'calm', 'grid'])
    colours[name] = style.getPropertyValue(`--${name}`).trim();
  colours.font = getComputedStyle(document.body).fontFamily;
}
readColours();
window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', readColours);

function clear({context, width, height}) {
  context.fillStyle = colours.card;
  context.fillRect(0, 0, width, height);
}

function label(context, text, x, y, {colour = colours.soft, align = 'left', size = 12, weight = ''} = {}) {
  context.font = `${weight} ${size}px ${colours.font}`;
  context.fillStyle = colour;
  context.textAlign = align;
  context.fillText(text, x, y);
}

/** Draws a line through points (x0, y0, x1, y1, ...). */
function stroke(context, points, colour, width = 1) {
  context.beginPath();
  for (let i = 0; i < points.length; i += 2) context.lineTo(points[i], points[i + 1]);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke();
}

function arrow(context, x, y, length, colour) {
  if (Math.abs(length) < 3) return;
  const head = Math.sign(length) * Math.min(9, Math.abs(length));
  stroke(context, [x, y, x + length - head / 2, y], colour, 3);
  context.beginPath();
  context.moveTo(x + length, y);
  context.lineTo(x + length - head, y - 5);
  context.lineTo(x + length - head, y + 5);
  context.fillStyle = colour;
  context.fill();
}
