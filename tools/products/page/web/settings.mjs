// Makes the page's sliders: their ranges, their labels, and the settings of the block that they change.
'use strict';

function shortNumber(value, digits = 3) {
  return Number(value.toPrecision(digits)).toLocaleString('en', {maximumFractionDigits: 6});
}
function lengthText(metres) {
  return metres < 0.9995e-3 ? `${shortNumber(metres * 1e6)} µm` : `${shortNumber(metres * 1e3)} mm`;
}
const percentText = (share) => `${shortNumber(100 * share, 2)} %`;

// Sliders of the page. `name` is a field of the library's Coefficients, or another setting, which has a `help` and a `first`
// value of its own. A slider has a part of the range that the library allows. With `scale: 'log'`, equal distances on the slider
// are equal ratios of the value.
const sliderTable = [
  {name: 'bristles', label: 'Bristles', low: 30, high: 30000, first: 1000, scale: 'log', whole: true,
   text: (v) => v.toLocaleString('en'), help: 'Representatives in contact. Fewer fluctuate more.'},
  {name: 'normal_load', label: 'Normal load', low: 0.2, high: 3, first: 1, text: (v) => `${v.toFixed(2)} N`,
   help: 'Presses block and floor together.'},
  {name: 'kinetic', low: 0.05, high: 1.2},
  {name: 'peak_above_kinetic', label: 'Peak above kinetic', low: 0, high: 0.6, first: 0.25, text: percentText,
   help: 'How much more breaks the block away at first loading.'},
  {name: 'presliding_length', low: 20e-6, high: 2e-3, scale: 'log', first: 0.5e-3},  // bends that can be seen
  {name: 'residual_share', low: 0, high: 0.4, text: percentText},
  {name: 'shared_renewal', low: 0, high: 3},
  {name: 'growth_per_decade', low: 0, high: 0.1, text: percentText},
  {name: 'spring', label: 'Spring of the hand', low: 10, high: 600, first: 60, scale: 'log',
   text: (v) => `${shortNumber(v)} N/m`, help: 'Soft springs stick and slip; stiff ones show the peak.'},
];

/** Returns the table of sliders, with names, units, ranges, defaults and texts of the library's coefficients filled in. */
export function slidersOf(coefficients) {
  return sliderTable.map((row) => {
    const field = coefficients.find(({name}) => name === row.name);
    if (!field) return row;
    const label = field.name[0].toUpperCase() + field.name.slice(1).replaceAll('_', ' ');
    const text = field.unit === 'm' ? lengthText : (v) => `${v.toFixed(2)} ${field.unit}`.trim();
    return {label, text, first: field.first, help: field.meaning, ...row,
      low: Math.max(row.low, field.least), high: Math.min(row.high, field.most)};
  });
}

function sliderValue(row, share) {
  const value = row.scale === 'log' ? row.low * (row.high / row.low) ** share : row.low + (row.high - row.low) * share;
  return row.whole ? Number(value.toPrecision(2)) : Number(value.toPrecision(3));
}
function sliderShare(row, value) {
  return row.scale === 'log' ? Math.log(value / row.low) / Math.log(row.high / row.low)
                             : (value - row.low) / (row.high - row.low);
}

function makeSettings(parent, coefficients, changed) {
  const settings = {contact: 'bristles'};
  const rows = slidersOf(coefficients).map((row) => {
    const box = document.createElement('div');
    box.className = 'slider';
    box.title = row.help;
    box.innerHTML = `<label for="s-${row.name}">${row.label}</label><output for="s-${row.name}"></output>` +
      `<input id="s-${row.name}" type="range" min="0" max="1" step="0.001">`;
    parent.append(box);
    const input = box.querySelector('input');
    const output = box.querySelector('output');
    const show = () => {
      output.textContent = row.text(settings[row.name]);
      input.setAttribute('aria-valuetext', output.textContent);
    };
    const set = (value) => {
      settings[row.name] = value;
      input.value = sliderShare(row, value);
      show();
    };
    input.addEventListener('input', () => {
      settings[row.name] = sliderValue(row, Number(input.value));
      show();
      changed();
    });
    set(row.first);
    return {row, box, input, set};
  });
  const withoutEffect = {bristles: [], cohorts: ['bristles'], slide: ['residual_share', 'shared_renewal']};
  const idle = () => {
    for (const {row, box, input} of rows) {
      input.disabled = withoutEffect[settings.contact].includes(row.name);
      box.classList.toggle('idle', input.disabled);
    }
  };
  return {
    values: settings,
    setContact(name) { settings.contact = name; idle(); changed(); },
    set(name, value) { rows.find((r) => r.row.name === name).set(value); changed(); },
    defaults() { rows.forEach((r) => r.set(r.row.first)); changed(); },
  };
}

// Returns the bristles' damping over load (s/m): 0.15 of critical damping of the block on its bent bristles,
// so that a block at rest stops swinging; bristles alone do not damp.
const blockMass = 0.1;  // kg
function dampingPerNewton(s) {
  const stiffness = s.kinetic * s.normal_load / s.presliding_length;
  return 0.3 * Math.sqrt(stiffness * blockMass) / s.normal_load;
}
const fadingSpeed = 0.02;  // speed over which the damping of bristles fades, m/s

function applySettings(library, s) {
  const derived = {peak: s.kinetic * (1 + s.peak_above_kinetic), damping_per_newton: dampingPerNewton(s),
    stribeck_velocity: fadingSpeed};
  return library.configure(['bristles', 'cohorts', 'slide'].indexOf(s.contact), s.bristles, s.normal_load, s.spring,
    {...s, ...derived});
}
