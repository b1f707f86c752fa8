// stick_settings.js — a person's own stick: from what their hand does to the stick h they mean. No page in here.

/** @typedef {import('./api.js').Stick} Stick */
/** @typedef {import('./joystick.js').Device} Device */
/**
 * @typedef {object} StickSettings
 * @property {boolean} invert_x with keys and gamepads, left is right
 * @property {boolean} invert_y with keys and gamepads, forward is back
 * @property {number} gain from 1 to 4
 * @property {boolean} one_axis only the larger of x and y counts
 * @property {boolean} steady tremor is taken out; the server does that, the page only shows it
 */

/** @type {Readonly<StickSettings>} */
export const NORMAL = Object.freeze({ invert_x: false, invert_y: false, gain: 1, one_axis: false, steady: false })
/** The time constant of a steady stick, as in app/teleop/stick_filter.py. */
export const STEADY_S = 0.25

const REST = Object.freeze({ x: 0, y: 0 })
// The other axis takes over once it is this much larger, so that nothing flickers at the diagonal.
const TAKES_OVER = 1.3
const PUSHES = ['All the way', 'Two thirds', 'Half way', 'Two fifths', 'A third', 'Under a third', 'A quarter']

/**
 * @param {Stick} h as the device gives it
 * @param {Device} device a pointer means where it is and is never inverted
 * @param {StickSettings} settings
 * @param {Stick} [before] what this gave last: its axis is given up only for one clearly larger
 * @returns {Stick} no longer than 1; zero if h is.
 */
export function adjust(h, device, settings, before = REST) {
  const isTurned = device !== 'pointer'
  const turned = { x: isTurned && settings.invert_x ? -h.x : h.x, y: isTurned && settings.invert_y ? -h.y : h.y }
  const { x, y } = settings.one_axis ? largerAxis(turned, before) : turned
  const r = Math.hypot(x, y)
  if (r === 0) return REST
  const scale = settings.gain * r > 1 ? 1 / r : settings.gain
  return { x: x * scale, y: y * scale }
}

/** @param {Stick} at @param {Stick} way along one axis @returns {Stick} what of `at` lies on that axis. */
export function onAxisOf(at, way) {
  return { x: way.x === 0 ? 0 : at.x, y: way.y === 0 ? 0 : at.y }
}

/** @param {StickSettings} one @param {StickSettings} other */
export function areSame(one, other) {
  return Object.keys(NORMAL).every((name) => one[name] === other[name])
}

/** @param {number} gain @returns {string} how far one has to push for everything, such as "Half way". */
export function pushInWords(gain) {
  const index = Math.round(2 * (gain - 1))
  return PUSHES[Math.min(PUSHES.length - 1, Math.max(0, index))]
}

/** A first-order low pass that lets go at once when the stick is let go. */
export class SteadyStick {
  constructor() {
    /** @type {Stick} */
    this.h = REST
  }

  /** @param {Stick} h @param {number} dt_s @param {boolean} isOn off: the stick as it is @returns {Stick} */
  follow(h, dt_s, isOn) {
    const share = isOn && (h.x !== 0 || h.y !== 0) ? 1 - Math.exp(-dt_s / STEADY_S) : 1
    this.h = { x: this.h.x + share * (h.x - this.h.x), y: this.h.y + share * (h.y - this.h.y) }
    return this.h
  }
}

function largerAxis({ x, y }, before) {
  let favour = 1
  if (before.x !== 0 && before.y === 0) favour = TAKES_OVER
  if (before.y !== 0 && before.x === 0) favour = 1 / TAKES_OVER
  return favour * Math.abs(x) > Math.abs(y) ? { x, y: 0 } : { x: 0, y }
}
