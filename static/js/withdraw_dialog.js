// withdraw_dialog.js — one button to stop taking part, and the choice of what becomes of what was given.
import { forgetDrafts } from './draft.js'
import { html } from './element.js'
import { newId } from './ids.js'

export class WithdrawDialog {
  /** @param {import('./visit.js').Visit} visit @param {HTMLElement} host */
  constructor(visit, host) {
    this.visit = visit
    this.id = newId() // one leaves once
    this.button = html('button', { class: 'button plain-text', type: 'button', 'aria-haspopup': 'dialog', 'data-testid': 'withdraw', hidden: true, onclick: () => this.element.showModal() }, 'Stop taking part')
    this.state = html('p', { class: 'quiet', role: 'status' })
    this.choices = [
      html('button', { class: 'button primary', type: 'button', 'data-testid': 'stay', onclick: () => this.element.close() }, 'Go on'),
      html('button', { class: 'button', type: 'button', 'data-testid': 'withdraw-keep', onclick: () => this.#leave(false) }, 'Stop, and leave what I gave'),
      html('button', { class: 'button', type: 'button', 'data-testid': 'withdraw-erase', onclick: () => this.#leave(true) }, 'Stop, and erase everything'),
    ]
    this.element = /** @type {HTMLDialogElement} */ (html('dialog', { class: 'dialog narrow', 'aria-labelledby': 'withdraw-title', 'aria-describedby': 'withdraw-words' },
      html('h2', { id: 'withdraw-title' }, 'Stop taking part?'),
      html('p', { id: 'withdraw-words' }, 'You can stop at any time, for any reason. What you gave so far can be left with the study, marked as withdrawn and not analysed, or be erased for good.'),
      html('div', { class: 'dialog-choices' }, this.choices),
      this.state))
    host.append(this.button, this.element)
    visit.watch(({ may_withdraw }) => {
      this.button.hidden = !may_withdraw
      // They stopped, or came to the end, in another tab.
      if (!may_withdraw) this.element.close()
    })
  }

  async #leave(erase) {
    this.#setBusy(true)
    this.state.textContent = 'One moment…'
    try {
      const session = await this.visit.api.postSurely('withdraw', { id: this.id, erase }, { onTrouble: (error) => (this.state.textContent = `${error.sentence} Trying again…`) })
      forgetDrafts(this.visit.api.base)
      this.visit.adopt(session)
    } catch (error) {
      this.visit.explain(error)
    } finally {
      this.#setBusy(false)
      this.state.textContent = ''
      this.element.close()
    }
  }

  #setBusy(isBusy) {
    for (const button of this.choices) button.disabled = isBusy
  }
}
