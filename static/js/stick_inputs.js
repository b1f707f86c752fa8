// stick_inputs.js — one stick for a step: the pad, the keyboard and the gamepads feed one state.
import { NO_PAD, readGamepads } from './gamepads.js'
import { STEERING_KEYS, StickState } from './joystick.js'
import { Keys } from './keys.js'
import { StickPad } from './stick_pad.js'
import { SteadyStick, adjust, areSame } from './stick_settings.js'

const POLL_MS = 20
const POINTERS = { mouse: 'mouse', touch: 'finger', pen: 'pen' }

export class StickInputs {
  /**
   * @param {object} options
   * @param {import('./visit.js').Visit} options.visit knows how the person has set their stick
   * @param {string} options.label
   * @param {string} options.hint
   * @param {string} [options.says]
   * @param {string} [options.name] of the pad; one of a dialog has the keys while it has the focus
   * @param {Record<string, () => void>} [options.shortcuts] keys, by KeyboardEvent.code
   * @param {Record<number, () => void>} [options.buttons] gamepad buttons, by number
   * @param {(direction: import('./api.js').Stick) => void} [options.onTap] a steering key went down
   * @param {(h: import('./api.js').Stick) => void} [options.onPointer] a pointer on the pad is here now
   * @param {(now_ms: number, dt_s: number) => void} [options.onPoll] the devices were looked at, however few pictures are drawn
   */
  constructor({ visit, label, hint, says, name, shortcuts = {}, buttons = {}, onTap = () => {}, onPointer = () => {}, onPoll = () => {} }) {
    this.state = new StickState()
    this.state.settings = visit.session.stick
    this.steady = new SteadyStick()
    this.buttons = buttons
    this.pointerKind = 'mouse'
    this.gamepad = NO_PAD
    this.found_ms = performance.now()
    this.polled_ms = this.found_ms
    this.pad = new StickPad({ label, hint, name, says, onMove: (h, kind) => {
      this.state.movePointer(h)
      if (h === null) return
      this.pointerKind = kind
      onPointer(this.state.pointer)
    } })
    this.keys = new Keys(this.state, shortcuts, (code) => {
      const [x, y] = STEERING_KEYS[code]
      onTap(adjust({ x, y }, 'keys', this.state.settings))
    }, name ? this.pad.pad : null)
    this.unwatch = visit.watch(({ stick }) => this.#set(stick))
    this.listening = new AbortController()
    const { signal } = this.listening
    addEventListener('blur', () => this.letGo(), { signal })
    // While a menu is open, keys and pointers go up unheard.
    addEventListener('contextmenu', () => this.letGo(), { signal })
    document.addEventListener('visibilitychange', () => this.letGo(), { signal })
    addEventListener('gamepaddisconnected', () => this.#poll(performance.now()), { signal })
    this.timer = setInterval(() => {
      const now_ms = performance.now()
      const dt_s = Math.min(0.1, (now_ms - this.polled_ms) / 1000)
      this.polled_ms = now_ms
      this.#poll(now_ms)
      onPoll(now_ms, dt_s)
    }, POLL_MS)
  }

  /** @param {boolean} isOn */
  set enabled(isOn) {
    this.pad.enabled = isOn
    this.keys.isOn = isOn
    if (!isOn) this.state.letGo()
  }

  get isOn() {
    return this.keys.isOn
  }

  /** @param {number} now_ms @returns {import('./api.js').Stick} */
  read(now_ms) {
    this.#poll(now_ms)
    return this.state.read(now_ms)
  }

  /** @param {number} now_ms @returns {{device: string | null, device_id: string, age_ms: number}} what pushes the stick, and how long ago it was last found there. */
  source(now_ms) {
    const isGamepad = this.state.device === 'gamepad'
    const device = this.state.device === 'pointer' ? (POINTERS[this.pointerKind] ?? 'mouse') : this.state.device
    return { device, device_id: isGamepad ? this.gamepad.id.slice(0, 200) : '', age_ms: Math.max(0, now_ms - this.found_ms) }
  }

  /** @param {number} now_ms @param {number} dt_s @returns {import('./api.js').Stick} as the arm follows it; for showing. */
  readSteady(now_ms, dt_s) {
    return this.steady.follow(this.read(now_ms), dt_s, this.state.settings.steady)
  }

  /** @returns {string | null} the device in words; null while nothing was touched. */
  get deviceName() {
    if (this.state.device === 'pointer') return POINTERS[this.pointerKind] ?? 'pointer'
    if (this.state.device === 'keys') return 'keys'
    return this.state.device === 'gamepad' ? this.gamepad.name : null
  }

  letGo() {
    this.pad.drop()
    this.state.letGo()
  }

  close() {
    clearInterval(this.timer)
    this.listening.abort()
    this.unwatch()
    this.keys.close()
    this.pad.close()
  }

  /** Whatever is pushed is let go: a stick that turns or grows under a hand would move the arm. */
  #set(settings) {
    if (areSame(settings, this.state.settings)) return
    this.letGo()
    this.state.settings = settings
  }

  #poll(now_ms) {
    // A window in the background must not steer.
    const isSeen = document.hasFocus() && document.visibilityState === 'visible'
    const before = this.gamepad
    this.gamepad = isSeen ? readGamepads() : NO_PAD
    if (this.isOn) {
      this.state.moveGamepad(this.gamepad.h)
      for (const button of this.gamepad.pressed) if (!before.pressed.has(button)) this.buttons[button]?.()
    }
    if (isSeen && this.#isThere()) this.found_ms = now_ms
  }

  /** Whether what pushes the stick is still there; a stick at rest needs nothing. */
  #isThere() {
    const { device } = this.state
    if (device === 'pointer') return this.pad.pointerId !== null || this.state.pointer === null
    if (device === 'gamepad') return this.gamepad !== NO_PAD || (this.state.pad.x === 0 && this.state.pad.y === 0)
    return true // keys are held as long as they are not heard to go up, and let go with the focus
  }
}

/** Calls back for each picture drawn, with the time since the last one; returns how to stop. */
export function eachFrame(draw) {
  let last_ms = performance.now()
  let frame = requestAnimationFrame(function next(now_ms) {
    frame = requestAnimationFrame(next)
    draw(now_ms, Math.min(0.1, Math.max(0, now_ms - last_ms) / 1000))
    last_ms = now_ms
  })
  return () => cancelAnimationFrame(frame)
}
