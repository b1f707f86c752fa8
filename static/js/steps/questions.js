// questions.js — a questionnaire: every item is answered or declined, and nothing typed is lost by a reload.
import { html } from '../element.js'
import { newId } from '../ids.js'

/** @typedef {{key: string, kind: 'scale' | 'choice' | 'text' | 'strategy', text: string, low: number, high: number, step: number, low_label: string, high_label: string, choices: string[]}} Item */
/** @typedef {{id: string, given: Record<string, {value: number | string | null, answered_at: string}>}} Draft */

const ORDINALS = ['First', 'Second', 'Third', 'Fourth', 'Fifth', 'Sixth', 'Seventh', 'Eighth', 'Ninth']

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountQuestions(root, context) {
  let step = new QuestionsStep(root, context)
  // The next questionnaire is of the same kind of step.
  const unwatch = context.visit.watch((session) => {
    if (session.step !== 'questions' || session.key === step.key) return
    step.close()
    root.replaceChildren()
    step = new QuestionsStep(root, context)
    scrollTo(0, 0)
    root.querySelector('h1')?.focus({ preventScroll: true })
  })
  return () => {
    unwatch()
    step.close()
  }
}

class QuestionsStep {
  constructor(root, { visit }) {
    this.visit = visit
    this.key = visit.session.key
    this.place = `joymap:${location.pathname}:${this.key}`
    this.stop = new AbortController()
    const { questionnaire, about, ways } = visit.session.questions
    this.items = questionnaire.items
    /** @type {Draft} */
    this.draft = this.#kept() ?? { id: newId(), given: {} }
    this.fields = new Map(this.items.map((item) => [item.key, this.#field(item, ways)]))
    this.state = html('p', { class: 'quiet', role: 'status', 'data-testid': 'questions-state' })
    this.button = html('button', { class: 'button primary large', type: 'submit', 'data-testid': 'send' }, 'Continue')
    root.append(html('form', { class: 'questions', novalidate: true, onsubmit: (event) => this.#send(event) },
      about && html('p', { class: 'quiet' }, about),
      html('h1', { tabindex: -1 }, questionnaire.title),
      questionnaire.intro && html('p', {}, questionnaire.intro),
      [...this.fields.values()],
      html('div', { class: 'consent-end' }, this.button, this.state)))
  }

  close() {
    this.stop.abort()
  }

  /** @param {Item} item @param {number} ways */
  #field(item, ways) {
    const given = this.draft.given[item.key]
    const options = this.#options(item, ways)
    const decline = html('label', { class: 'decline' },
      this.#radio(item, 'decline', given !== undefined && given.value === null, () => this.#give(item, null)), 'I’d rather not say')
    const answer = options === null
      ? this.#words(item, typeof given?.value === 'string' ? given.value : '')
      : html('div', { class: item.kind === 'scale' ? 'scale' : 'choices', style: null },
        item.kind === 'scale' && html('span', { class: 'scale-end' }, item.low_label),
        options.map(({ value, title }) => html('label', { class: 'option' }, this.#radio(item, String(value), given?.value === value, () => this.#give(item, value)), html('span', {}, title))),
        item.kind === 'scale' && html('span', { class: 'scale-end' }, item.high_label))
    return html('fieldset', { class: 'item', 'data-item': item.key }, html('legend', {}, item.text), answer, decline)
  }

  #options(item, ways) {
    if (item.kind === 'choice') return item.choices.map((title) => ({ value: title, title }))
    if (item.kind === 'strategy') return Array.from({ length: ways }, (_, index) => ({ value: index + 1, title: `${ORDINALS[index] ?? index + 1} way` }))
    if (item.kind === 'text') return null
    const count = Math.floor((item.high - item.low) / item.step) + 1
    return Array.from({ length: count }, (_, index) => item.low + index * item.step).map((value) => ({ value, title: String(value) }))
  }

  #radio(item, value, checked, onChoose) {
    return html('input', { type: 'radio', name: item.key, value, checked, onchange: onChoose })
  }

  #words(item, text) {
    const area = /** @type {HTMLTextAreaElement} */ (html('textarea', { rows: 3, maxlength: 5000, 'aria-label': item.text, oninput: () => {
      if (area.value.trim()) this.#give(item, area.value)
      else this.#take(item)
      this.fields.get(item.key).querySelector('input[value=decline]').checked = false
    } }))
    area.value = text
    return area
  }

  #give(item, value) {
    this.draft.given[item.key] = { value, answered_at: new Date().toISOString() }
    this.fields.get(item.key)?.removeAttribute('data-missing')
    if (item.kind === 'text' && value === null) this.fields.get(item.key).querySelector('textarea').value = ''
    this.#keep()
  }

  #take(item) {
    delete this.draft.given[item.key]
    this.#keep()
  }

  #keep() {
    try {
      sessionStorage.setItem(this.place, JSON.stringify(this.draft))
    } catch {
      // A full or forbidden store: the draft then lives as long as the page.
    }
  }

  #kept() {
    try {
      return JSON.parse(sessionStorage.getItem(this.place) ?? 'null')
    } catch {
      return null
    }
  }

  async #send(event) {
    event.preventDefault()
    const missing = this.items.filter(({ key }) => this.draft.given[key] === undefined)
    if (missing.length > 0) {
      for (const { key } of missing) this.fields.get(key).dataset.missing = 'true'
      this.state.textContent = missing.length === 1 ? 'One question is still open.' : `${missing.length} questions are still open.`
      this.fields.get(missing[0].key).querySelector('input, textarea').focus()
      return
    }
    this.button.disabled = true
    this.state.textContent = 'One moment…'
    const responses = this.items.map(({ key }) => ({ item: key, ...this.draft.given[key] }))
    const { signal } = this.stop
    try {
      const session = await this.visit.api.postSurely('questions', { id: this.draft.id, key: this.key, responses }, { signal, onTrouble: () => (this.state.textContent = 'Not saved yet, trying again…') })
      try {
        sessionStorage.removeItem(this.place)
      } catch {
        // Nothing was kept there.
      }
      this.visit.adopt(session)
    } catch (error) {
      if (signal.aborted) return
      this.button.disabled = false
      this.state.textContent = ''
      this.visit.explain(error)
    }
  }
}
