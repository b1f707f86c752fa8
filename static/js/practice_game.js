// practice_game.js — places to bring the stick to, one after the other. No page in here.
import { deflection } from './joystick.js'

/** @typedef {{x: number, y: number, says: string, isGentle?: boolean}} Target */

export const REACH = 0.24 // how near counts
const HOLD_S = 0.35
const DIAGONAL = Math.SQRT1_2

/** @type {readonly Target[]} */
export const TARGETS = Object.freeze([
  { x: 0, y: 1, says: 'Push all the way forward' },
  { x: 0.5, y: 0, says: 'Now gently to the right', isGentle: true },
  { x: -DIAGONAL, y: DIAGONAL, says: 'Forward and left at once' },
  { x: 0, y: -1, says: 'All the way back' },
  { x: -0.5, y: 0, says: 'Gently to the left', isGentle: true },
  { x: DIAGONAL, y: -DIAGONAL, says: 'Back and right at once' },
  { x: 0, y: 0.5, says: 'Gently forward', isGentle: true },
  { x: 1, y: 0, says: 'All the way to the right' },
  { x: -DIAGONAL, y: -DIAGONAL, says: 'Back and left at once' },
])

const LET_GO = Object.freeze({ x: 0, y: 0, says: 'Well done. Let go: the stick comes back by itself' })

/** A target, then letting go, then the next; round and round. */
export class PracticeGame {
  constructor() {
    this.index = 0
    this.reached = 0
    this.held_s = 0
    this.isLettingGo = false
  }

  /** @returns {Target} */
  get target() {
    return this.isLettingGo ? LET_GO : TARGETS[this.index % TARGETS.length]
  }

  /** @returns {number} how much of the holding is done, in [0, 1]. */
  get fraction() {
    return Math.min(1, this.held_s / HOLD_S)
  }

  /** @param {import('./api.js').Stick} h @param {number} dt_s @returns {boolean} whether the target changed. */
  follow(h, dt_s) {
    const { x, y } = this.target
    const isThere = this.isLettingGo ? deflection(h) === 0 : Math.hypot(h.x - x, h.y - y) < REACH
    this.held_s = isThere ? this.held_s + dt_s : 0
    if (this.held_s < HOLD_S) return false
    this.held_s = 0
    if (this.isLettingGo) this.index += 1
    else this.reached += 1
    this.isLettingGo = !this.isLettingGo
    return true
  }
}
