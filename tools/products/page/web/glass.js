// Draws bristles under the block: the tip of a bristle follows the block, its foot stays behind on the floor.
'use strict';

function makeGlass() {
  const view = openCanvas('glass');
  const note = document.getElementById('glass-note');
  let before = new Float64Array(0);
  let noteText = '';

  function drawBand(context, top, bottom, offset, lengthScale) {
    context.fillStyle = colours.block;
    context.fillRect(0, 0, view.width, top);
    stroke(context, [0, top, view.width, top], colours['block-edge'], 1.5);
    context.fillStyle = colours['floor-fill'];
    context.fillRect(0, bottom, view.width, view.height - bottom);
    stroke(context, [0, bottom, view.width, bottom], colours.floor, 1.5);
    const pitch = 26;
    const shift = ((-offset * lengthScale) % pitch + pitch) % pitch;
    for (let x = shift - pitch; x < view.width + pitch; x += pitch)
      stroke(context, [x, bottom + 2, x - 7, view.height], colours.floor, 1);
  }

  return {
    draw(library, state, settings) {
      const {context, width, height} = view;
      const spacing = width > 700 ? 15 : 12;
      const scale = 2.0 * spacing / settings.presliding_length;  // scale of the drawing, pixels per metre
      const wanted = Math.min(Math.floor(width / spacing) - 2, 512);
      const shown = settings.contact === 'cohorts' ? wanted : Math.min(wanted, Math.floor(state.active));
      const bends = library.bends(Math.max(shown, 1));
      if (before.length !== shown) before = new Float64Array(shown);
      const top = 20;
      const bottom = height - 24;
      clear(view);
      drawBand(context, top, bottom, state.position, scale);
      const groups = [[], [], [], []];  // bristles grouped by bend, so that each colour is set once
      for (let i = 0; i < shown; ++i) {
        const bend = bends[i];
        const share = Math.abs(bend) / settings.presliding_length;
        const snapped = Math.abs(before[i]) - Math.abs(bend) > 0.4 * settings.presliding_length;
        before[i] = bend;
        groups[snapped ? 3 : share > 1.0 ? 2 : share > 0.5 ? 1 : 0].push(i);
      }
      const paints = [colours.calm, colours.friction, colours.pull, colours.peak];
      const left = (width - spacing * (wanted - 1)) / 2;
      groups.forEach((group, g) => {
        context.beginPath();
        for (const i of group) {
          const x = left + spacing * i * (shown > 1 ? (wanted - 1) / Math.max(shown - 1, 1) : 1);
          const foot = x - bends[i] * scale;
          context.moveTo(x, top);
          context.quadraticCurveTo(x, (top + bottom) / 2 + 8, foot, bottom);
        }
        context.strokeStyle = paints[g];
        context.lineWidth = g === 3 ? 3 : 2;
        context.stroke();
      });
      const bar = settings.presliding_length * scale;
      stroke(context, [width - 12 - bar, height - 8, width - 12, height - 8], colours.ink, 2);
      context.fillStyle = colours['floor-fill'];
      const barText = lengthText(settings.presliding_length);
      context.font = `12px ${colours.font}`;
      const textWidth = context.measureText(barText).width;
      context.fillRect(width - 20 - bar - textWidth - 4, height - 19, textWidth + 8, 18);
      label(context, barText, width - 20 - bar, height - 5, {align: 'right', colour: colours.ink});
      const text = settings.contact === 'cohorts' ? `${shown} bristles that the cohorts stand for, youngest first`
        : `${shown} of ${Math.round(state.active).toLocaleString('en')} bristles`;
      if (text !== noteText) note.textContent = noteText = text;
    },
  };
}
