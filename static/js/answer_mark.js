// answer_mark.js — where the person would put the stick: a mark that stays when they let go.
import { CENTRE, DEAD_ZONE, deflection, limit } from './joystick.js'
import { SteadyStick, onAxisOf } from './stick_settings.js'

/** @typedef {import('./api.js').Stick} Stick */

const SPEED = 1.1 // of the mark under keys, in radii a second
const GENTLE_SPEED = 0.35
const TAP = 0.1 // a first tap carries the mark out of the dead zone
const STEADY_MS = 250
const STEADY_WITHIN = 0.12

/** The largest deflection that a gamepad was held at for a moment. */
export class SteadyDeflection {
  constructor() {
    this.reset()
  }

  reset() {
    /** @type {Stick | null} */
    this.best = null
    this.anchor = CENTRE
    this.since_ms = 0
  }

  /** @param {Stick} h @param {number} now_ms @returns {Stick | null} newly found; null otherwise. */
  feed(h, now_ms) {
    if (deflection(h) === 0) {
      this.reset()
      return null
    }
    if (Math.hypot(h.x - this.anchor.x, h.y - this.anchor.y) > STEADY_WITHIN) {
      this.anchor = h
      this.since_ms = now_ms
      return null
    }
    if (now_ms - this.since_ms < STEADY_MS) return null
    if (this.best !== null && deflection(h) <= deflection(this.best) + 0.02) return null
    this.best = h
    return h
  }
}

/** The mark, fed with what a StickState holds. */
export class AnswerMark {
  constructor() {
    this.steady = new SteadyDeflection()
    this.hand = new SteadyStick()
    this.set(null)
  }

  /** @param {Stick | null} h */
  set(h) {
    this.at = h ?? CENTRE
    this.steady.reset()
  }

  /** @returns {Stick | null} the answer; null while there is none. */
  get h() {
    return deflection(this.at) < DEAD_ZONE ? null : this.at
  }

  /** A steering key went down. @param {Stick} direction */
  tap(direction) {
    if (this.h === null) this.at = { x: direction.x * TAP, y: direction.y * TAP }
  }

  /** The pointer is here now: what it does counts, not what of it is drawn. @param {Stick} h */
  point(h) {
    this.at = h
  }

  /** Take the gamepad's stick as it is now. @param {Stick} h */
  press(h) {
    if (deflection(h) > 0) this.at = h
  }

  /**
   * What keys and gamepads do while they are held.
   *
   * @param {import('./joystick.js').StickState} state
   * @param {number} dt_s
   * @param {number} now_ms
   */
  follow(state, dt_s, now_ms) {
    if (state.device === 'keys') {
      const way = (state.isGentle ? GENTLE_SPEED : SPEED) * dt_s
      const { x, y } = state.direction
      const from = state.settings.one_axis ? onAxisOf(this.at, { x, y }) : this.at
      if (x !== 0 || y !== 0) this.at = limit({ x: from.x + x * way, y: from.y + y * way })
    }
    // A hand that shakes would hold its gamepad nowhere for long enough.
    const pushed = this.hand.follow(state.pad, dt_s, state.settings.steady)
    if (state.device === 'gamepad') this.at = this.steady.feed(pushed, now_ms) ?? this.at
  }
}
