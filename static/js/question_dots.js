// question_dots.js — one dot for each question: where we are, what is answered, a way back.
import { html } from './element.js'

export class QuestionDots {
  /** @param {(index: number) => void} onChoose */
  constructor(onChoose) {
    this.onChoose = onChoose
    this.list = html('ol', { class: 'dots' })
    this.element = html('nav', { 'aria-label': 'Questions' }, this.list)
  }

  /** @param {import('./api.js').Query[]} queries @param {number} current */
  draw(queries, current) {
    while (this.list.children.length > queries.length) this.list.lastChild.remove()
    while (this.list.children.length < queries.length) this.list.append(this.#dot(this.list.children.length))
    const first = queries.findIndex((query) => query.answer === null)
    queries.forEach((query, index) => {
      const button = /** @type {HTMLButtonElement} */ (this.list.children[index].firstChild)
      const state = stateOf(query)
      button.dataset.state = state
      button.disabled = first !== -1 && index > first
      button.setAttribute('aria-label', `Question ${index + 1}, ${state}`)
      if (index === current) button.setAttribute('aria-current', 'true')
      else button.removeAttribute('aria-current')
    })
  }

  #dot(index) {
    return html('li', {}, html('button', { class: 'dot', type: 'button', 'data-testid': `query-dot-${index + 1}`, onclick: () => this.onChoose(index) }, String(index + 1)))
  }
}

function stateOf({ answer }) {
  if (answer === null) return 'open'
  return answer.h === null ? 'skipped' : 'answered'
}
