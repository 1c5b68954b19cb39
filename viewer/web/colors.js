// Colours that values are shown in: the same as in `cairn view`. All are sRGB, 0 to 255.
import { DataTexture, LinearFilter, NearestFilter, RGBAFormat } from 'three';

// Nine equally spaced values of viridis (van der Walt, Smith 2015), joined by lines.
const RAMP = [
  [68, 1, 84],
  [71, 44, 122],
  [59, 81, 139],
  [44, 113, 142],
  [33, 144, 141],
  [39, 173, 129],
  [92, 200, 99],
  [170, 220, 50],
  [253, 231, 37],
];

// Okabe, Ito 2008: told apart by colour-blind people too.
const PALETTE = [
  [230, 159, 0],
  [86, 180, 233],
  [0, 158, 115],
  [240, 228, 66],
  [0, 114, 178],
  [213, 94, 0],
  [204, 121, 167],
];

// The classes of the LAS specification 1.4, table 17.
const CLASSES = [
  ['Never classified', [150, 150, 150]],
  ['Unassigned', [190, 190, 190]],
  ['Ground', [153, 102, 51]],
  ['Low vegetation', [163, 209, 102]],
  ['Medium vegetation', [92, 168, 62]],
  ['High vegetation', [28, 107, 42]],
  ['Building', [226, 92, 60]],
  ['Low noise', [255, 0, 255]],
  ['Model key point', [120, 200, 220]],
  ['Water', [52, 120, 220]],
  ['Rail', [130, 110, 160]],
  ['Road surface', [90, 90, 100]],
  ['Overlap', [230, 230, 120]],
  ['Wire, guard', [250, 220, 80]],
  ['Wire, conductor', [250, 180, 40]],
  ['Transmission tower', [200, 120, 60]],
  ['Wire connector', [160, 160, 220]],
  ['Bridge deck', [180, 150, 130]],
  ['High noise', [255, 60, 180]],
];

export const css = ([red, green, blue]) => `rgb(${red} ${green} ${blue})`;
export const paletteColor = (index) => PALETTE[index % PALETTE.length];
export const classColor = (number) => CLASSES[number]?.[1] ?? paletteColor(number);
export const className = (number) => CLASSES[number]?.[0] ?? `Class ${number}`;
export const rampCss = () => `linear-gradient(to right, ${RAMP.map(css).join(', ')})`;

function rampColor(share) {
  const at = share * (RAMP.length - 1);
  const below = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[below].map((value, i) => Math.round(value + (at - below) * (RAMP[below + 1][i] - value)));
}

function texture(colorOf, filter) {
  const bytes = new Uint8Array(256 * 4);
  for (let i = 0; i < 256; ++i) bytes.set([...colorOf(i), 255], 4 * i);
  const made = new DataTexture(bytes, 256, 1, RGBAFormat);
  made.minFilter = made.magFilter = filter;
  made.needsUpdate = true;
  return made;
}

export const rampTexture = () => texture((i) => rampColor(i / 255), LinearFilter);
export const classTexture = () => texture(classColor, NearestFilter);
