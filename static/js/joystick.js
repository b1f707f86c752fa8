// joystick.js — pointer, keys and gamepad to human input h in the unit disc. No page in here.
import { NORMAL, adjust } from './stick_settings.js'

/** @typedef {import('./api.js').Stick} Stick */
/** @typedef {'pointer' | 'keys' | 'gamepad'} Device */

export const DEAD_ZONE = 0.08 // fraction of the radius
export const GENTLE = 0.5 // deflection of keys while shift is held
// A key tapped for less than this gives less than a full push.
const RAMP_MS = 150

/** @type {Readonly<Stick>} */
export const CENTRE = Object.freeze({ x: 0, y: 0 })

const ARROWS = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] }
// Physical places, so that the same four keys serve on every keyboard layout.
const LETTERS = { KeyW: [0, 1], KeyS: [0, -1], KeyA: [-1, 0], KeyD: [1, 0] }
/** @type {Record<string, [number, number]>} */
export const STEERING_KEYS = Object.freeze({ ...ARROWS, ...LETTERS })

/** @returns {number} how far the stick is pushed, in [0, 1]. */
export function deflection({ x, y }) {
  return Math.hypot(x, y)
}

/** @param {Stick} h @returns {Stick} the same direction, no longer than 1. */
export function limit({ x, y }) {
  const r = Math.hypot(x, y)
  return r > 1 ? { x: x / r, y: y / r } : { x, y }
}

/**
 * A pointer does not drift: outside its dead zone it means just where it is.
 *
 * @param {number} dx to the right of the pad's centre, in pixels
 * @param {number} dy below the pad's centre, in pixels
 * @param {number} radius in pixels
 * @returns {Stick} zero inside the dead zone.
 */
export function toHumanInput(dx, dy, radius) {
  if (!(radius > 0)) return CENTRE
  const h = { x: dx / radius, y: -dy / radius }
  return deflection(h) < DEAD_ZONE ? CENTRE : limit(h)
}

/**
 * A gamepad's stick may rest off its centre: what is left outside the dead zone is stretched to [0, 1]. A stick of which
 * an axis is missing, or tells no number, is at rest.
 */
export function fromGamepadAxes(right, down) {
  const r = Math.hypot(right, down)
  if (!(r >= DEAD_ZONE)) return CENTRE
  const scale = Math.min(1, (r - DEAD_ZONE) / (1 - DEAD_ZONE)) / r
  return { x: right * scale, y: -down * scale }
}

/** @param {Iterable<string>} codes of held keys @returns {Stick} unit direction; zero if they cancel. */
export function keyDirection(codes) {
  let x = 0
  let y = 0
  for (const code of codes) {
    x += STEERING_KEYS[code]?.[0] ?? 0
    y += STEERING_KEYS[code]?.[1] ?? 0
  }
  x = Math.sign(x)
  y = Math.sign(y)
  const r = Math.hypot(x, y)
  return r === 0 ? CENTRE : { x: x / r, y: y / r }
}

/** What the hands mean on all devices, by their settings; the device used last is the one that counts. */
export class StickState {
  constructor() {
    /** @type {import('./stick_settings.js').StickSettings} */
    this.settings = NORMAL
    /** @type {Device | null} */
    this.device = null
    /** @type {Stick | null} */
    this.pointer = null
    this.held = new Set()
    this.isGentle = false
    this.pad = CENTRE
    this.pushed = CENTRE // the gamepad's stick as it is
    this.direction = CENTRE // where the keys point, without ramp
    this.ramped = CENTRE
    this.keyed = CENTRE
    this.last_ms = null
  }

  /** @param {Stick | null} h null: let go. */
  movePointer(h) {
    this.pointer = h && adjust(h, 'pointer', this.settings, this.pointer ?? CENTRE)
    if (h !== null) this.device = 'pointer'
  }

  press(code) {
    this.held.add(code)
    this.device = 'keys'
    this.#point()
  }

  release(code) {
    this.held.delete(code)
    this.#point()
  }

  releaseAll() {
    this.held.clear()
    this.#point()
  }

  /** @param {Stick} h A stick held still does not take over from another device. */
  moveGamepad(h) {
    const isMoved = Math.hypot(h.x - this.pushed.x, h.y - this.pushed.y) > 0.03
    if (isMoved && deflection(h) > 0) this.device = 'gamepad'
    if (!isMoved && this.device !== 'gamepad' && deflection(h) > 0) return
    this.pushed = h
    this.pad = adjust(h, 'gamepad', this.settings, this.pad)
  }

  letGo() {
    this.pointer = null
    this.releaseAll()
    this.isGentle = false
    this.ramped = CENTRE
    this.keyed = CENTRE
    this.pad = CENTRE
    this.pushed = CENTRE
  }

  /** @param {number} now_ms @returns {Stick} */
  read(now_ms) {
    const dt_ms = this.last_ms === null ? 0 : Math.max(0, now_ms - this.last_ms)
    this.last_ms = now_ms
    this.ramped = this.#ramp(dt_ms)
    this.keyed = adjust(this.ramped, 'keys', this.settings, this.keyed)
    if (this.device === 'pointer') return this.pointer ?? CENTRE
    if (this.device === 'gamepad') return this.pad
    return this.keyed
  }

  #point() {
    this.direction = adjust(keyDirection(this.held), 'keys', this.settings, this.direction)
  }

  /** Towards the keys' direction; letting go is at once, for it means stop. */
  #ramp(dt_ms) {
    const { x, y } = keyDirection(this.held)
    if (x === 0 && y === 0) return CENTRE
    const reach = this.isGentle ? GENTLE : 1
    const dx = x * reach - this.ramped.x
    const dy = y * reach - this.ramped.y
    const left = Math.hypot(dx, dy)
    const step = dt_ms / RAMP_MS
    if (left <= step) return { x: x * reach, y: y * reach }
    return { x: this.ramped.x + (dx / left) * step, y: this.ramped.y + (dy / left) * step }
  }
}
