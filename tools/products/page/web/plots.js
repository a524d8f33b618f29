// Draws friction over displacement and over time, from the block's ring buffer of past states.
'use strict';

/** A step of 1, 2 or 5 times a power of ten that divides `range` into about `count`. */
function tickStep(range, count) {
  const raw = range / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5].find((m) => m * power >= raw) || 10);
}

function tickText(value, step) {
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const text = value.toFixed(digits);
  return Number(text) === 0 ? '0' : text.replace('-', '−');
}

function makeAxes(view, unit) {
  const left = 40, right = 8, top = 8, bottom = 32;
  const axes = {x0: 0, x1: 1, y0: -1, y1: 1};
  axes.x = (v) => left + (v - axes.x0) / (axes.x1 - axes.x0) * (view.width - left - right);
  axes.y = (v) => top + (axes.y1 - v) / (axes.y1 - axes.y0) * (view.height - top - bottom);
  axes.inside = (draw) => {
    view.context.save();
    view.context.beginPath();
    view.context.rect(left, top, view.width - left - right, view.height - top - bottom);
    view.context.clip();
    draw();
    view.context.restore();
  };
  axes.draw = (xUnit, xFactor) => {
    const context = view.context;
    clear(view);
    const xStep = tickStep((axes.x1 - axes.x0) * xFactor, view.width > 420 ? 6 : 4);
    for (let i = Math.ceil(axes.x0 * xFactor / xStep); i * xStep <= axes.x1 * xFactor; ++i) {
      const x = axes.x(i * xStep / xFactor);
      stroke(context, [x, top, x, view.height - bottom], colours.grid);
      label(context, tickText(i * xStep, xStep), x, view.height - bottom + 14, {align: 'center', size: 11});
    }
    const yStep = tickStep(axes.y1 - axes.y0, 6);
    for (let i = Math.ceil(axes.y0 / yStep); i * yStep <= axes.y1; ++i) {
      const y = axes.y(i * yStep);
      stroke(context, [left, y, view.width - right, y], i === 0 ? colours.floor : colours.grid);
      label(context, tickText(i * yStep, yStep), left - 5, y + 4, {align: 'right', size: 11});
    }
    label(context, xUnit, view.width - right, view.height - 4, {align: 'right', size: 11});
    label(context, unit, 2, view.height - 4, {size: 11});
  };
  axes.limits = (state) => {
    const context = view.context;
    context.setLineDash([5, 4]);
    for (const sign of [1, -1]) {
      const right_ = view.width - right;
      stroke(context, [left, axes.y(sign * state.kinetic), right_, axes.y(sign * state.kinetic)], colours.kinetic);
      stroke(context, [left, axes.y(sign * state.peak), right_, axes.y(sign * state.peak)], colours.peak);
    }
    context.setLineDash([]);
    const apart = axes.y(state.kinetic) - axes.y(state.peak) > 6;
    label(context, `peak at first loading${apart ? '' : ', kinetic'}`, left + 4, axes.y(state.peak) - 3, {colour: colours.peak, size: 11});
    if (apart) label(context, 'kinetic', left + 4, axes.y(state.kinetic) + 12, {colour: colours.kinetic, size: 11});
  };
  return axes;
}

/** Returns half the height of a plot, N: 1.3 times the peak of friction, or what the samples reach if that is more. */
function forceRange(samples, first, last, remembered, state, field) {
  let most = 1.3 * state.peak;
  for (let i = first; i < last; i += 4) most = Math.max(most, 1.08 * Math.abs(samples[4 * (i % remembered) + field]));
  return most;
}

function makeCurve() {
  const view = openCanvas('curve');
  const axes = makeAxes(view, 'N, against the motion');
  const longest = 12000;  // limit of a curve's length, in samples
  return {
    range: 'all',
    draw(library, state, settings) {
      const samples = library.samples();
      const remembered = library.remembered;
      const last = state.steps;
      const first = Math.max(0, last - longest);
      const stride = Math.max(1, Math.ceil((last - first) / 3000));
      let low = state.position, high = state.position;
      if (this.range === 'all')
        for (let i = first; i < last; i += stride) {
          const x = samples[4 * (i % remembered) + 1];
          low = Math.min(low, x);
          high = Math.max(high, x);
        }
      const least = 5 * settings.presliding_length;
      const pad = Math.max(0.06 * (high - low), 0.5 * (least - (high - low)));
      axes.x0 = low - pad;
      axes.x1 = high + pad;
      axes.y1 = forceRange(samples, first, last, remembered, state, 2);
      axes.y0 = -axes.y1;
      const micro = axes.x1 - axes.x0 < 2e-3;
      axes.draw(micro ? 'displacement, µm' : 'displacement, mm', micro ? 1e6 : 1e3);
      axes.limits(state);
      axes.inside(() => {
        // Draws older parts fainter. Strides count from sample 0, so that the curve does not tremble.
        const pieces = 6;
        for (let p = 0; p < pieces; ++p) {
          const from = first + Math.floor((last - first) * p / pieces);
          const to = first + Math.floor((last - first) * (p + 1) / pieces);
          const points = [];
          for (let i = Math.max(0, from - from % stride - stride); i < to; i += stride) {
            const at = 4 * (i % remembered);
            points.push(axes.x(samples[at + 1]), axes.y(-samples[at + 2]));
          }
          if (p === pieces - 1) points.push(axes.x(state.position), axes.y(-state.friction));
          view.context.globalAlpha = 0.15 + 0.85 * ((p + 1) / pieces) ** 2;
          stroke(view.context, points, colours.friction, 1.8);
        }
        view.context.globalAlpha = 1;
        view.context.beginPath();
        view.context.arc(axes.x(state.position), axes.y(-state.friction), 4.5, 0, 2 * Math.PI);
        view.context.fillStyle = colours.friction;
        view.context.fill();
      });
    },
  };
}

function makeTrace() {
  const view = openCanvas('trace');
  const axes = makeAxes(view, 'N');
  return {
    draw(library, state, speed) {
      const samples = library.samples();
      const remembered = library.remembered;
      const seconds = Math.max(0.1, 5 * speed);
      const span = Math.round(seconds * 1000);
      const last = state.steps;
      const first = Math.max(0, last - span);
      const stride = Math.max(1, Math.ceil(span / 1200));
      axes.x1 = Math.max(last, span) * 1e-3;
      axes.x0 = axes.x1 - seconds;
      axes.y1 = Math.max(forceRange(samples, first, last, remembered, state, 2),
        forceRange(samples, first, last, remembered, state, 3));
      axes.y0 = -axes.y1;
      axes.draw(seconds < 1 ? 'ms' : 's', seconds < 1 ? 1e3 : 1);
      axes.limits(state);
      axes.inside(() => {
        for (const [field, sign, colour] of [[3, 1, colours.pull], [2, -1, colours.friction]]) {
          const points = [];
          for (let i = first - first % stride; i < last; i += stride) {
            const at = 4 * (i % remembered);
            points.push(axes.x(samples[at]), axes.y(sign * samples[at + field]));
          }
          stroke(view.context, points, colour, 1.6);
        }
      });
    },
  };
}
