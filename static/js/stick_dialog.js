// stick_dialog.js — a person sets their stick: tried and saved at once, kept for wherever they come back.
import { ApiError } from './api.js'
import { html } from './element.js'
import { newId } from './ids.js'
import { StickInputs, eachFrame } from './stick_inputs.js'
import { NORMAL, pushInWords } from './stick_settings.js'

/** @typedef {import('./stick_settings.js').StickSettings} StickSettings */

export class StickDialog {
  /** @param {import('./visit.js').Visit} visit @param {(isOpen: boolean) => void} onChange */
  constructor(visit, onChange) {
    this.visit = visit
    this.onChange = onChange
    this.isSaving = false
    /** @type {StickSettings | null} */
    this.unsaved = null
    this.end = () => {}
    this.button = html('button', { class: 'button plain-text', type: 'button', 'aria-haspopup': 'dialog', 'data-testid': 'adjust-stick', onclick: () => this.open() }, 'Adjust the stick')
    this.content = html('div', { class: 'stick-settings' })
    this.element = /** @type {HTMLDialogElement} */ (html('dialog', { class: 'dialog stick-dialog', 'aria-labelledby': 'stick-title', onclose: () => this.#closed() },
      html('div', { class: 'dialog-head' },
        html('h2', { id: 'stick-title' }, 'Adjust the stick'),
        html('button', { class: 'button', type: 'button', 'data-testid': 'close-stick', onclick: () => this.element.close() }, 'Close')),
      this.content))
  }

  get isOpen() {
    return this.element.open
  }

  open() {
    if (this.element.open) return
    this.element.showModal()
    this.onChange(true)
    const inputs = new StickInputs({
      visit: this.visit,
      name: 'stick-trial',
      label: 'Joystick to try',
      hint: 'Push with the arrow keys or W, A, S, D. The arm does not move.',
    })
    this.#build(inputs)
    const unwatch = this.visit.watch(({ stick }) => this.#draw(stick))
    const stopDrawing = eachFrame((now_ms, dt_s) => inputs.pad.draw(inputs.readSteady(now_ms, dt_s)))
    this.end = () => {
      unwatch()
      stopDrawing()
      inputs.close()
    }
    this.#draw(this.visit.session.stick)
    inputs.pad.focus()
  }

  /** The step is over. What is still to be saved is saved all the same. */
  close() {
    this.end()
    this.element.remove()
  }

  #closed() {
    this.end()
    this.end = () => {}
    this.content.replaceChildren()
    this.onChange(false)
  }

  /** Counts at once on this page. @param {Partial<StickSettings>} change */
  #set(change) {
    this.unsaved = { ...this.visit.session.stick, ...change }
    this.#adopt(this.unsaved)
    this.#say('')
    void this.#save()
  }

  /** Nothing but the stick: by now the person may be a step further than the answer says. @param {StickSettings} stick */
  #adopt(stick) {
    this.visit.adopt({ ...this.visit.session, stick })
  }

  /** One change after the other, so that the last one is the last to arrive. */
  async #save() {
    if (this.isSaving) return
    this.isSaving = true
    try {
      while (this.unsaved !== null) {
        const body = { id: newId(), ...this.unsaved }
        this.unsaved = null
        const { stick } = await this.visit.api.putSurely('stick', body, { onTrouble: (error) => this.#say(`Not saved yet. ${error.sentence} Trying again…`) })
        if (this.unsaved === null) this.#adopt(stick)
      }
      this.#say('Saved.')
    } catch (error) {
      if (!(error instanceof ApiError)) throw error
      this.unsaved = null
      this.#say(error.sentence)
      await this.visit.refresh()
    } finally {
      this.isSaving = false
    }
  }

  #say(sentence) {
    this.state.textContent = sentence
  }

  /** @param {StickSettings} stick */
  #draw(stick) {
    for (const [name, box] of this.boxes) box.checked = stick[name]
    this.range.value = String(stick.gain)
    const words = pushInWords(stick.gain)
    this.rangeWords.textContent = words
    this.range.setAttribute('aria-valuetext', words)
  }

  #build(inputs) {
    /** @type {Map<keyof StickSettings, HTMLInputElement>} */
    this.boxes = new Map()
    this.state = html('p', { class: 'quiet small', role: 'status', 'data-testid': 'stick-saved' })
    this.rangeWords = html('span', { class: 'quiet', 'data-testid': 'stick-push' })
    this.range = /** @type {HTMLInputElement} */ (html('input', {
      type: 'range', min: 1, max: 4, step: 0.5, id: 'stick-gain', 'data-testid': 'stick-gain',
      oninput: () => this.#set({ gain: Number(this.range.value) }),
    }))
    this.content.replaceChildren(
      html('div', { class: 'stick-trial' }, inputs.pad.element, html('p', { class: 'quiet small' }, 'Try it here. The arm does not move.')),
      html('div', { class: 'stick-choices' },
        html('div', { class: 'stick-range' },
          html('label', { for: 'stick-gain' }, 'How far you have to push'), this.rangeWords, this.range),
        this.#box('one_axis', 'One direction at a time', 'Of a slanting push only the larger part counts.'),
        this.#box('steady', 'Steady (for hands that shake)', 'The arm follows a little later.'),
        html('fieldset', {},
          html('legend', {}, 'With keys or a gamepad'),
          this.#box('invert_y', 'Forward is back'),
          this.#box('invert_x', 'Left is right')),
        html('div', { class: 'stick-end' },
          html('button', { class: 'button', type: 'button', 'data-testid': 'stick-normal', onclick: () => this.#set(NORMAL) }, 'Back to normal'),
          this.state)))
  }

  /** @param {'invert_x' | 'invert_y' | 'one_axis' | 'steady'} name */
  #box(name, words, note = '') {
    const box = /** @type {HTMLInputElement} */ (html('input', {
      type: 'checkbox', 'data-testid': `stick-${name}`, 'aria-describedby': note ? `stick-${name}-note` : null,
      onchange: () => this.#set({ [name]: box.checked }),
    }))
    this.boxes.set(name, box)
    return html('div', { class: 'stick-box' }, html('label', {}, box, words), note && html('p', { class: 'quiet small', id: `stick-${name}-note` }, note))
  }
}
