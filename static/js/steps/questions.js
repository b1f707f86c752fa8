// questions.js — a questionnaire: every item is answered or declined, and nothing typed is lost by a reload.
import { Draft, optionsOf } from '../draft.js'
import { html } from '../element.js'

/** @typedef {import('../draft.js').Item} Item */

// So many marks stand in one row of their own, with their numbers left to the ends and the middle.
const MANY = 11

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountQuestions(root, context) {
  const step = new QuestionsStep(root, context)
  return () => step.close()
}

class QuestionsStep {
  constructor(root, { visit }) {
    this.visit = visit
    const { key, questions: { questionnaire, about, ways } } = visit.session
    this.draft = new Draft(questionnaire.items, key, visit.api.base)
    this.stop = new AbortController()
    this.fields = new Map(questionnaire.items.map((item, index) => [item.key, this.#field(item, index, ways)]))
    this.state = html('p', { class: 'quiet', role: 'status', 'data-testid': 'questions-state' })
    this.button = html('button', { class: 'button primary large', type: 'submit', 'data-testid': 'send' }, 'Continue')
    root.append(html('form', { class: 'questions', novalidate: true, onsubmit: (event) => this.#send(event) },
      html('div', {},
        about && html('p', { class: 'quiet' }, about),
        html('h1', { tabindex: -1 }, questionnaire.title)),
      questionnaire.intro && html('p', {}, questionnaire.intro),
      [...this.fields.values()],
      html('div', { class: 'consent-end' }, this.button, this.state)))
  }

  close() {
    this.stop.abort()
  }

  /** @param {Item} item @param {number} index @param {number} ways */
  #field(item, index, ways) {
    const options = optionsOf(item, ways)
    const openId = `item-${index}-open`
    const field = html('fieldset', { class: 'item', 'data-item': item.key, 'aria-describedby': openId },
      html('legend', {}, item.text),
      options === null ? this.#words(item) : item.kind === 'scale' ? this.#scale(item, options) : this.#choices(item, options),
      html('label', { class: 'decline' }, this.#radio(item, null), 'I’d rather not say'),
      html('p', { class: 'item-open', id: openId, hidden: true }, 'Please answer, or say that you would rather not.'))
    return field
  }

  #scale(item, options) {
    const isMany = options.length > MANY
    return html('div', { class: 'scale', 'data-many': isMany },
      html('span', { class: 'scale-end', 'aria-hidden': 'true' }, item.low_label),
      html('div', { class: 'scale-marks' }, options.map(({ value, title, end }, index) => {
        const isSaid = !isMany || index % 10 === 0
        // What the ends mean is heard with their numbers.
        return html('label', { class: 'option', title: isSaid ? null : title }, this.#radio(item, value),
          html('span', { class: isSaid ? null : 'unseen' }, title), end && html('span', { class: 'unseen' }, `, ${end}`))
      })),
      html('span', { class: 'scale-end', 'aria-hidden': 'true' }, item.high_label))
  }

  #choices(item, options) {
    return html('div', { class: 'choices' }, options.map(({ value, title }) => html('label', { class: 'option' }, this.#radio(item, value), html('span', {}, title))))
  }

  #radio(item, value) {
    return html('input', { type: 'radio', name: item.key, value: value ?? 'decline', checked: this.draft.valueOf(item) === value, 'data-decline': value === null, onchange: () => this.#give(item, value) })
  }

  #words(item) {
    const area = /** @type {HTMLTextAreaElement} */ (html('textarea', { rows: 3, maxlength: 5000, 'aria-label': item.text, oninput: () => {
      const words = area.value
      this.fields.get(item.key).querySelector('[data-decline]').checked = false
      if (words.trim()) this.#give(item, words)
      else this.draft.take(item)
    } }))
    area.value = String(this.draft.valueOf(item) ?? '')
    return area
  }

  #give(item, value) {
    this.draft.give(item, value)
    const field = this.fields.get(item.key)
    delete field.dataset.missing
    field.querySelector('.item-open').hidden = true
    if (item.kind === 'text' && value === null) field.querySelector('textarea').value = ''
    if (this.state.dataset.open) this.#say()
  }

  /** Which items are open still. */
  #say() {
    const { open } = this.draft
    this.state.dataset.open = String(open.length || '')
    if (open.length === 0) this.state.textContent = ''
    else this.state.textContent = open.length === 1 ? `Still open: “${open[0].text}”` : `${open.length} questions are still open, first: “${open[0].text}”`
  }

  async #send(event) {
    event.preventDefault()
    const { open } = this.draft
    for (const { key } of open) {
      this.fields.get(key).dataset.missing = 'true'
      this.fields.get(key).querySelector('.item-open').hidden = false
    }
    if (open.length > 0) {
      this.#say()
      this.fields.get(open[0].key).querySelector('input, textarea').focus()
      return
    }
    if (this.button.disabled) return
    this.button.disabled = true
    this.state.textContent = 'One moment…'
    const { signal } = this.stop
    try {
      const session = await this.visit.api.postSurely('questions', this.draft.body, { signal, onTrouble: () => (this.state.textContent = 'Not saved yet, trying again…') })
      this.draft.forget()
      this.visit.adopt(session)
    } catch (error) {
      if (signal.aborted) return
      this.button.disabled = false
      this.state.textContent = ''
      this.visit.explain(error)
    }
  }
}
