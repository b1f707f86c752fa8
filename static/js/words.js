// words.js — stick positions, times and devices in words.
import { DEAD_ZONE, deflection } from './joystick.js'

/** @param {import('./api.js').Stick} h @returns {string} such as "forward and a little left, half way". */
export function inWords(h) {
  const r = deflection(h)
  if (r < DEAD_ZONE) return 'in the middle'
  return `${directionInWords(h)}, ${amount(r)}`
}

/** @param {import('./api.js').Stick} h @returns {string} such as "forward and a little left". */
export function directionInWords({ x, y }) {
  const along = { size: Math.abs(y), word: y > 0 ? 'forward' : 'back' }
  const across = { size: Math.abs(x), word: x > 0 ? 'right' : 'left' }
  const [major, minor] = along.size >= across.size ? [along, across] : [across, along]
  const share = minor.size / major.size
  if (share < 0.2) return major.word
  return share < 0.65 ? `${major.word} and a little ${minor.word}` : `${along.word} and ${across.word}`
}

function amount(r) {
  if (r < 0.35) return 'gently'
  if (r < 0.7) return 'half way'
  return r < 0.95 ? 'far' : 'all the way'
}

/** @param {string} id as a browser tells it, such as "Xbox Pad (STANDARD GAMEPAD Vendor: 045e Product: 02fd)" */
export function gamepadName(id) {
  const name = id.replace(/\s*\(.*\)\s*$/, '').replace(/^[0-9a-f]{4}-[0-9a-f]{4}-/i, '').trim()
  return name || 'gamepad'
}

/** @param {number} seconds @returns {string} such as "0.4 s", "38 s" or "2 min 5 s". */
export function durationInWords(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`
  if (seconds < 60) return `${Math.round(seconds)} s`
  const whole = Math.round(seconds)
  return `${Math.floor(whole / 60)} min ${whole % 60} s`
}

/** @param {number} seconds @returns {string} such as "0:07" or "12:40". */
export function clockTime(seconds) {
  const whole = Math.floor(seconds)
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`
}

/** @param {number} count @param {string} noun */
export function counted(count, noun, nouns = `${noun}s`) {
  return `${count} ${count === 1 ? noun : nouns}`
}
