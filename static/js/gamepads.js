// gamepads.js — whichever gamepad is plugged in: its largest stick and its buttons.
import { CENTRE, deflection, fromGamepadAxes } from './joystick.js'
import { gamepadName } from './words.js'

/** @typedef {{h: import('./api.js').Stick, name: string | null, id: string, pressed: Set<number>}} PadReading */

/** @type {Readonly<PadReading>} a hand on no gamepad: nothing is pushed. */
export const NO_PAD = Object.freeze({ h: CENTRE, name: null, id: '', pressed: new Set() })

const CROSS = [[12, 0, 1], [13, 0, -1], [14, -1, 0], [15, 1, 0]]

/** @param {Gamepad} pad @returns {import('./api.js').Stick} its stick that is pushed furthest. */
export function largestStick(pad) {
  // Only the standard layout says that axes 2 and 3 are a stick; elsewhere they may be triggers.
  const isStandard = pad.mapping === 'standard'
  const pairs = isStandard ? [[0, 1], [2, 3]] : [[0, 1]]
  const sticks = pairs.map(([right, down]) => fromGamepadAxes(pad.axes[right], pad.axes[down]))
  if (isStandard) {
    const cross = { x: 0, y: 0 }
    for (const [button, x, y] of CROSS) {
      if (!pad.buttons[button]?.pressed) continue
      cross.x += x
      cross.y += y
    }
    const r = Math.hypot(cross.x, cross.y) || 1
    sticks.push({ x: cross.x / r, y: cross.y / r })
  }
  return sticks.reduce((best, stick) => (deflection(stick) > deflection(best) ? stick : best), CENTRE)
}

/** @returns {Readonly<PadReading>} the pad that is pushed furthest; NO_PAD when none can be read, as once it is unplugged. */
export function readGamepads() {
  let best = NO_PAD
  for (const pad of connected()) {
    const h = largestStick(pad)
    const pressed = new Set(pad.buttons.flatMap((button, index) => (button.pressed ? [index] : [])))
    const isBetter = best === NO_PAD || deflection(h) > deflection(best.h) || (pressed.size > 0 && best.pressed.size === 0)
    if (isBetter) best = { h, name: gamepadName(pad.id), id: pad.id, pressed }
  }
  return best
}

function connected() {
  try {
    return (navigator.getGamepads?.() ?? []).filter((pad) => pad?.connected)
  } catch {
    return [] // a page that is not a secure context, or not allowed to
  }
}
