// The panel: what is drawn and how exact it is, and the settings.
import { MODES } from './point_material.js';
import { classColor, className, css, paletteColor, rampCss } from './colors.js';

const byId = (id) => document.getElementById(id);
const counted = new Intl.NumberFormat('en-US');
const short = new Intl.NumberFormat('en-US', { notation: 'compact', maximumSignificantDigits: 3 });
const length = (metres) => {
  const size = Math.abs(metres);
  if (size === 0) return '0 m';
  if (size >= 0.1) return `${metres.toFixed(size < 10 ? 2 : 1)} m`;
  return size >= 0.001 ? `${(1000 * metres).toFixed(1)} mm` : '< 1 mm';
};
const pixels = (value) =>
  !Number.isFinite(value) || value > 1e6 ? 'unbounded' : `${value.toFixed(value < 10 ? 1 : 0)} px`;

// What the sliders run through.
const BUDGETS = [100e3, 200e3, 500e3, 1e6, 2e6, 3e6, 5e6, 10e6, 20e6, 50e6];
const ERRORS = [0.5, 1, 1.5, 2, 3, 4, 6, 8, 16, 32, 64];

const TITLES = {
  color: 'Color',
  intensity: 'Intensity',
  classification: 'Classification',
  height: 'Height',
  level: 'Level of detail',
};

export class Panel {
  /** `onChange` is called with the settings whenever one changes, `onHome` when the whole is to be seen. */
  constructor(onChange, onHome) {
    for (const id of ['budget', 'error', 'size', 'adaptive', 'relief', 'mode'])
      byId(id).addEventListener('input', () => {
        this.#tellSettings();
        onChange(this.settings());
      });
    byId('home').addEventListener('click', onHome);
    byId('fold').addEventListener('click', () => this.#fold(!byId('body').hidden));
    // On narrow screens the panel covers what it tells of.
    const narrow = matchMedia('(max-width: 640px)');
    narrow.addEventListener('change', () => this.#fold(narrow.matches));
    if (narrow.matches) this.#fold(true);
    this.#tellSettings();
  }

  settings() {
    return {
      budget: BUDGETS[Number(byId('budget').value)],
      errorTarget: ERRORS[Number(byId('error').value)],
      size: Number(byId('size').value),
      adaptive: byId('adaptive').checked,
      relief: byId('relief').checked,
      mode: byId('mode').value,
    };
  }

  /** Offers what the tiles have, and chooses the first of it. */
  offer(available) {
    for (const option of byId('mode').options) {
      option.disabled = !available.has(option.value);
      option.hidden = option.disabled;
    }
    byId('mode').value = MODES.find((mode) => available.has(mode));
  }

  tellOrigin(points, crs) {
    const place = decodeURIComponent(location.pathname)
      .split('/')
      .filter((part) => part && part !== 'index.html')
      .pop();
    document.title = byId('title').textContent = place ?? 'Point cloud';
    byId('summary').textContent = `${counted.format(points)} points${crs ? ` · ${crs}` : ''}`;
  }

  tell(drawn) {
    byId('points-drawn').textContent = `${counted.format(drawn.points)} of ${short.format(drawn.budget)}`;
    byId('budget-meter').value = Math.min(1, drawn.points / drawn.budget);
    byId('tiles-drawn').textContent =
      `${drawn.tiles}, ${drawn.loaded} loaded${drawn.waiting ? `, ${drawn.waiting} to come` : ''}`;
    byId('levels-drawn').textContent = drawn.levels.length ? drawn.levels.join(', ') : '–';
    byId('error-target').textContent = `${pixels(drawn.target)}${drawn.limited ? ' (budget)' : ''}`;
    byId('error-screen').textContent = drawn.finest ? '0 px: all is drawn' : pixels(drawn.screenError);
    byId('error-bound').textContent = length(drawn.bound);
    byId('error-rms').textContent = length(drawn.rms);
  }

  /** `ranges` of intensity and height, the `classes` and the `levels` that were met. */
  tellLegend(mode, { ranges, classes, levels }) {
    const keys = (list) =>
      `<ul class="keys">${list.map(([color, name]) => `<li><i style="background:${css(color)}"></i>${name}</li>`).join('')}</ul>`;
    const legend = byId('legend');
    let html = '';
    if (mode === 'intensity' || mode === 'height') {
      const [least, greatest] = ranges[mode];
      const told = (value) => (mode === 'height' ? length(value) : short.format(value));
      html = `<div class="ramp" style="background:${rampCss()}"></div><div class="ends"><span>${told(least)}</span><span>${told(greatest)}</span></div>`;
    } else if (mode === 'classification') html = keys(classes.map((number) => [classColor(number), className(number)]));
    else if (mode === 'level') html = keys(levels.map((level) => [paletteColor(level), `Level ${level}`]));
    if (legend.innerHTML !== html) legend.innerHTML = html;
    legend.setAttribute('aria-label', `Legend: ${TITLES[mode]}`);
  }

  complain(text) {
    byId('message').textContent = text;
    byId('message').hidden = false;
  }

  #tellSettings() {
    const { budget, errorTarget, size, adaptive } = this.settings();
    byId('budget-value').textContent = short.format(budget);
    byId('error-value').textContent = pixels(errorTarget);
    byId('size-value').textContent = adaptive ? `${size.toFixed(1)} ×` : `${size.toFixed(1)} px`;
  }

  #fold(folded) {
    byId('body').hidden = folded;
    byId('fold').setAttribute('aria-expanded', String(!folded));
  }
}
