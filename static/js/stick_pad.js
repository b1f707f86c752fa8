// stick_pad.js — the round pad on the page: draws the stick and follows a pointer on it.
import { html, svg } from './element.js'
import { CENTRE, deflection, toHumanInput } from './joystick.js'
import { inWords } from './words.js'

/** @typedef {import('./api.js').Stick} Stick */

// Screen readers hear where the stick is once it has rested there.
const REST_MS = 500

export class StickPad {
  /**
   * @param {{label: string, hint: string, name?: string, says?: string, onMove: (h: Stick | null, kind: string) => void}} options
   *   `name` tells two pads in one page apart; `says` goes before the spoken words of where the stick is; without it there are none.
   */
  constructor({ label, hint, name = 'stick', says, onMove }) {
    this.onMove = onMove
    this.says = says ?? null
    this.pointerId = null
    this.isOn = true
    this.timer = 0
    this.shown = ''
    this.sentence = ''
    this.stem = svg('line', { class: 'pad-stem', x1: 0, y1: 0, x2: 0, y2: 0 })
    this.knob = svg('g', {},
      svg('circle', { class: 'pad-knob', r: 0.2 }),
      svg('circle', { class: 'pad-knob-rim', r: 0.15 }),
      svg('path', { class: 'pad-tick', d: 'M-0.08 0.01-0.02 0.07 0.09-0.06' }))
    const hintId = `${name}-hint`
    this.pad = html('div', {
      class: 'pad', 'data-testid': name, 'data-state': 'empty', role: 'slider', tabindex: 0,
      'aria-roledescription': 'joystick', 'aria-label': label, 'aria-describedby': hintId,
      'aria-valuemin': 0, 'aria-valuemax': 100, 'aria-valuenow': 0, 'aria-valuetext': 'in the middle',
      onpointerdown: (event) => this.#begin(event),
      onpointermove: (event) => this.#follow(event),
      onpointerup: (event) => this.#letGo(event),
      onpointercancel: (event) => this.#end(event),
      onlostpointercapture: (event) => this.#end(event),
      oncontextmenu: (event) => event.preventDefault(),
    }, face(this.stem, this.knob))
    this.words = html('p', { class: 'stick-words quiet', hidden: !this.says })
    this.spoken = html('p', { class: 'unseen', 'aria-live': 'polite' })
    this.element = html('div', { class: 'stick' }, this.pad, this.words, this.spoken,
      html('p', { class: 'unseen', id: hintId }, hint))
    this.draw(CENTRE)
  }

  /** @param {boolean} isOn */
  set enabled(isOn) {
    this.isOn = isOn
    this.pad.setAttribute('aria-disabled', String(!isOn))
    if (!isOn) this.drop()
  }

  /** Forget a pointer that is still down. */
  drop() {
    if (this.pointerId === null) return
    const id = this.pointerId
    this.pointerId = null
    if (this.pad.hasPointerCapture(id)) this.pad.releasePointerCapture(id)
    this.onMove(null, '')
  }

  /** @param {Stick | null} h null: no answer yet @param {'empty' | 'marked' | 'saved' | 'live'} [state] */
  draw(h, state = 'live') {
    const { x, y } = h ?? CENTRE
    const key = `${x},${y},${state}`
    if (key === this.shown) return
    this.shown = key
    this.knob.setAttribute('transform', `translate(${x} ${-y})`)
    this.stem.setAttribute('x2', String(x))
    this.stem.setAttribute('y2', String(-y))
    this.pad.dataset.state = state === 'live' && deflection({ x, y }) === 0 ? 'empty' : state
    if (h === null) {
      delete this.pad.dataset.x
      delete this.pad.dataset.y
    } else {
      this.pad.dataset.x = x.toFixed(4)
      this.pad.dataset.y = y.toFixed(4)
    }
    this.#say(h)
  }

  /** @param {boolean} isOn whether the picture has arrows in the pad's colours */
  set ways(isOn) {
    this.pad.dataset.ways = String(isOn)
  }

  focus() {
    this.pad.focus({ preventScroll: true })
  }

  close() {
    clearTimeout(this.timer)
    this.drop()
  }

  #say(h) {
    const sentence = h === null ? 'Nothing marked yet' : inWords(h)
    if (sentence === this.sentence) return
    this.sentence = sentence
    if (this.says !== null) this.words.textContent = sentence
    clearTimeout(this.timer)
    this.timer = setTimeout(() => {
      this.pad.setAttribute('aria-valuenow', String(Math.round(100 * deflection(h ?? CENTRE))))
      this.pad.setAttribute('aria-valuetext', sentence)
      // Who has the stick in focus hears its value already.
      if (this.says !== null && document.activeElement !== this.pad) this.spoken.textContent = `${this.says} ${sentence}.`
    }, REST_MS)
  }

  #at(event) {
    const box = this.pad.getBoundingClientRect()
    const dx = event.clientX - box.left - box.width / 2
    const dy = event.clientY - box.top - box.height / 2
    return toHumanInput(dx, dy, box.width / 2)
  }

  #begin(event) {
    if (!this.isOn || this.pointerId !== null || event.button !== 0) return
    this.pointerId = event.pointerId
    this.pad.setPointerCapture(event.pointerId)
    this.onMove(this.#at(event), event.pointerType)
  }

  #follow(event) {
    if (event.pointerId === this.pointerId) this.onMove(this.#at(event), event.pointerType)
  }

  /** Where the pointer is let go it may not have been before: moves wait for the next picture, this does not. */
  #letGo(event) {
    this.#follow(event)
    this.#end(event)
  }

  #end(event) {
    if (event.pointerId !== this.pointerId) return
    this.pointerId = null
    this.onMove(null, event.pointerType)
  }
}

function face(stem, knob) {
  const chevrons = [0, 90, 180, 270].map((turn) =>
    svg('path', { class: 'pad-chevron', d: 'M-0.06-0.83 0-0.89 0.06-0.83', transform: `rotate(${turn})` }))
  return svg('svg', { viewBox: '-1 -1 2 2', 'aria-hidden': 'true' },
    svg('circle', { class: 'pad-ground', r: 0.99 }),
    svg('circle', { class: 'pad-ring', r: 0.5 }),
    svg('path', { class: 'pad-cross', d: 'M-0.72 0H0.72M0-0.72V0.72' }),
    chevrons, ways(), stem, knob)
}

/** A dot at each side in the colour of the arrow at the hand; seen while the arrows are. */
function ways() {
  const sides = { up: [0, -1], right: [1, 0], down: [0, 1], left: [-1, 0] }
  return svg('g', { class: 'pad-ways' }, Object.entries(sides).map(([side, [x, y]]) =>
    svg('circle', { class: `pad-way-${side}`, cx: 0.86 * x, cy: 0.86 * y, r: 0.075 })))
}
