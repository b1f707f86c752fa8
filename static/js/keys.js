// keys.js — the keyboard, without taking keys from whoever else needs them.
import { STEERING_KEYS } from './joystick.js'

// Places where arrows, letters or Enter already mean something.
const FIELDS = 'input, textarea, select, [contenteditable], [role=radiogroup], dialog'
const PRESSABLE = 'button, a[href], summary'

/** @param {KeyboardEvent} event @param {Element | null} [home] what may have keys of its own within such a place */
export function isTaken(event, home = null) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.isComposing) return true
  if (home?.contains(/** @type {Node} */ (event.target))) return false
  return event.target instanceof Element && event.target.closest(FIELDS) !== null
}

/** Tells of steering keys, and of single keys that are short for a button. */
export class Keys {
  /**
   * @param {import('./joystick.js').StickState} state
   * @param {Record<string, () => void>} [shortcuts] by KeyboardEvent.code
   * @param {(code: string) => void} [onTap]
   * @param {Element | null} [home] as in isTaken
   */
  constructor(state, shortcuts = {}, onTap = () => {}, home = null) {
    this.state = state
    this.shortcuts = shortcuts
    this.onTap = onTap
    this.home = home
    this.isOn = true
    this.listening = new AbortController()
    const { signal } = this.listening
    addEventListener('keydown', (event) => this.#down(event), { signal })
    addEventListener('keyup', (event) => this.#up(event), { signal })
  }

  close() {
    this.listening.abort()
  }

  #down(event) {
    this.state.isGentle = event.shiftKey
    if (event.ctrlKey || event.altKey || event.metaKey) this.state.releaseAll()
    if (!this.isOn || isTaken(event, this.home)) return
    if (event.code in STEERING_KEYS) {
      event.preventDefault()
      if (event.repeat) return
      this.state.press(event.code)
      this.onTap(event.code)
      return
    }
    if (event.repeat || !(event.code in this.shortcuts)) return
    const isPress = (event.code === 'Enter' || event.code === 'Space') && event.target instanceof Element && event.target.closest(PRESSABLE)
    if (isPress) return
    event.preventDefault()
    this.shortcuts[event.code]()
  }

  #up(event) {
    this.state.isGentle = event.shiftKey
    this.state.release(event.code)
  }
}
