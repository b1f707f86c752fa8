// learned_dialog.js — a look back at what was learned, over the driving page.
import { html } from './element.js'
import { LearnedPanel } from './learned.js'

export class LearnedDialog {
  /** @param {import('./visit.js').Visit} visit @param {(isOpen: boolean) => void} onChange */
  constructor(visit, onChange) {
    this.visit = visit
    this.onChange = onChange
    /** @type {LearnedPanel | null} */
    this.panel = null
    this.content = html('div', { class: 'dialog-content' })
    this.element = /** @type {HTMLDialogElement} */ (html('dialog', { class: 'dialog', 'aria-labelledby': 'learned-title', onclose: () => this.#closed() },
      html('div', { class: 'dialog-head' },
        html('h2', { id: 'learned-title' }, 'What the robot learned'),
        html('button', { class: 'button', type: 'button', 'data-testid': 'close-learned', onclick: () => this.element.close() }, 'Close')),
      this.content))
  }

  get isOpen() {
    return this.element.open
  }

  async open() {
    if (this.element.open) return
    this.content.replaceChildren(html('p', { class: 'quiet' }, 'Reading…'))
    this.element.showModal()
    this.onChange(true)
    try {
      const training = await this.visit.api.get('training')
      if (!this.element.open) return
      this.panel = new LearnedPanel(this.visit.session)
      this.content.replaceChildren(this.panel.element)
      this.panel.update(training.strategies ?? {})
    } catch (error) {
      this.element.close()
      this.visit.explain(error)
    }
  }

  close() {
    this.panel?.close()
    this.element.remove()
  }

  #closed() {
    this.panel?.close()
    this.panel = null
    this.content.replaceChildren()
    this.onChange(false)
  }
}
