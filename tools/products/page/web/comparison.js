// Runs the experiments of `bristle experiment` in the page and draws the brush beside other friction models.
'use strict';

const comparisons = [
  {canvas: 'drift', x: 's', y: 'moved, µm', scale: 1e6,
   judged: (v) => `${tickText(v, 0.01)} µm a swing`},
  {canvas: 'rubbing', x: 'strokes to and fro', y: 'highest force over kinetic', scale: 1,
   judged: (v) => `last force over first ${tickText(v, 0.01)}`},
  {canvas: 'rolling', x: 's', y: 'lag, % of the distance', scale: 100, least: -0.1, most: 0.7,
   judged: (v) => v ? `at twice the speed ${tickText(v, 0.01)} of it` : 'none'},
];
const modelTitles = {brush_rubbed: 'brush', brush_redraw: "the paper's brush", lugre: 'LuGre', coulomb: 'Coulomb',
  bed: 'bed of bristles', patch: 'one patch'};
const modelColours = ['friction', 'pull', 'kinetic'];

function makeComparison(library, number) {
  const it = comparisons[number];
  const view = openCanvas(it.canvas);
  const axes = makeAxes(view, it.y);
  const legend = document.getElementById(`${it.canvas}-legend`);
  const models = library.comparedModels(number);
  const curves = [];
  const draw = () => {
    if (!curves.length) return;
    let low = 0, high = 0, end = 0;
    for (const {points} of curves)
      for (let i = 0; i < points.length; i += 2) {
        low = Math.min(low, it.scale * points[i + 1]);
        high = Math.max(high, it.scale * points[i + 1]);
        end = Math.max(end, points[i]);
      }
    Object.assign(axes, {x1: end, y0: it.least ?? low - 0.05 * (high - low), y1: it.most ?? high + 0.08 * (high - low)});
    axes.draw(it.x, 1);
    axes.inside(() => curves.forEach(({points}, model) => {
      const inPixels = Array.from(points, (value, i) => i % 2 ? axes.y(it.scale * value) : axes.x(value));
      stroke(view.context, inPixels, colours[modelColours[model]], 1.8);
    }));
  };
  new ResizeObserver(draw).observe(view.canvas);
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);
  return {
    models,
    run(model) {
      const curve = library.compare(number, model);
      curves.push(curve);
      const entry = document.createElement('span');
      entry.innerHTML = `<i class="key ${modelColours[model]}"></i>`;
      entry.append(`${modelTitles[models[model]]}: ${it.judged(curve.finding)}`);
      legend.append(entry);
      draw();
      return {model: models[model], finding: curve.finding, shown: curve.shown};
    },
  };
}

/** Runs all comparisons, one model at a time with pauses for the pictures, then times the bristles. */
async function runComparisons(library) {
  const found = [];
  for (let number = 0; number < comparisons.length; ++number) {
    const comparison = makeComparison(library, number);
    for (let model = 0; model < comparison.models.length; ++model) {
      await new Promise((resume) => setTimeout(resume, 50));
      found.push({comparison: comparisons[number].canvas, ...comparison.run(model)});
    }
  }
  const us = library.stepMicroseconds();
  document.getElementById('rate').textContent = `${(10000 / us).toFixed(0)} million`;
  return found;
}
