// strategy_choice.js — which mapping the stick goes through: a group of radio buttons.
import { html } from './element.js'

// Arrow keys steer the arm, so here they only move the focus; Space or Enter chooses.
const MOVES = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }

export class StrategyChoice {
  /** @param {import('./api.js').Strategy[]} strategies @param {(name: string) => void} onChoose */
  constructor(strategies, onChoose) {
    this.strategies = strategies
    this.note = html('p', { class: 'quiet small strategy-note', id: 'strategy-note' })
    this.buttons = strategies.map(({ name, title }, index) =>
      html('button', {
        class: 'segment', type: 'button', role: 'radio', 'aria-checked': 'false', 'aria-describedby': 'strategy-note',
        'data-testid': `strategy-${name}`, 'aria-keyshortcuts': String(index + 1), onclick: () => onChoose(name),
      }, title, ' ', html('kbd', { 'aria-hidden': 'true', class: 'keycap' }, String(index + 1))))
    this.group = html('div', { class: 'segments', role: 'radiogroup', 'aria-label': 'Way of steering', onkeydown: (event) => this.#walk(event) }, this.buttons)
    this.element = html('div', { class: 'strategies' }, this.group, this.note)
  }

  /** @param {string} chosen */
  draw(chosen) {
    this.strategies.forEach(({ name, note }, index) => {
      const isChosen = name === chosen
      this.buttons[index].setAttribute('aria-checked', String(isChosen))
      this.buttons[index].tabIndex = isChosen ? 0 : -1
      if (isChosen && this.note.textContent !== note) this.note.textContent = note
    })
  }

  #walk(event) {
    const move = MOVES[event.key]
    if (!move) return
    event.preventDefault()
    const at = this.buttons.indexOf(document.activeElement)
    this.buttons[(at + move + this.buttons.length) % this.buttons.length].focus()
  }
}
