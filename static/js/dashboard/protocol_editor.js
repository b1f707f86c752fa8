// protocol_editor.js — a protocol as a form and as YAML, the same thing: the server turns one into the other.
import { ApiError } from '../api.js'
import { html } from '../element.js'

/** @typedef {{name: string, title: string}} Choice */
/** @typedef {{tasks: (Choice & {has_goal: boolean})[], strategies: Choice[], orders: Choice[], template: object}} Choices */

const WAIT_MS = 350

export class ProtocolEditor {
  /** @param {import('../api.js').Api} api @param {Choices} choices @param {object} protocol */
  constructor(api, choices, protocol) {
    this.api = api
    this.choices = { ...choices, tasks: choices.tasks.filter(({ has_goal }) => has_goal) }
    this.protocol = structuredClone(protocol)
    this.asked = 0
    this.said = html('p', { class: 'bad', role: 'alert', 'data-testid': 'protocol-error' })
    this.yaml = /** @type {HTMLTextAreaElement} */ (html('textarea', { class: 'yaml', spellcheck: false, 'aria-label': 'The protocol as YAML', 'data-testid': 'yaml', oninput: () => this.#soon({ yaml: this.yaml.value }) }))
    this.form = html('div', { class: 'form' })
    this.steps = html('div', { 'data-testid': 'steps', 'aria-live': 'polite' })
    this.element = html('div', { class: 'two' },
      html('div', { class: 'form', style: null }, this.form, html('details', { open: true }, html('summary', {}, 'The same as YAML'), this.yaml)),
      html('section', { class: 'card', 'aria-label': 'What participants do' }, html('h2', {}, 'What participants do'), this.said, this.steps))
    this.isGood = false
    void this.#check({ protocol: this.protocol })
  }

  /** What to send: the YAML as it stands. */
  get content() {
    return { yaml: this.yaml.value }
  }

  #soon(content) {
    clearTimeout(this.timer)
    this.timer = setTimeout(() => void this.#check(content), WAIT_MS)
  }

  async #check(content) {
    const asked = ++this.asked
    try {
      const { protocol, yaml, steps, minutes } = await this.api.post('protocols/check', content)
      if (asked !== this.asked) return
      this.protocol = protocol
      if (content.yaml === undefined) this.yaml.value = yaml
      this.said.textContent = ''
      this.isGood = true
      this.steps.replaceChildren(
        html('p', { class: 'quiet' }, `${steps.length - 1} steps, about ${minutes} minutes`),
        html('ol', { class: 'steps-list' }, steps.map(({ title }) => html('li', {}, title))))
      if (content.yaml !== undefined || this.form.childElementCount === 0) this.#draw()
    } catch (error) {
      if (!(error instanceof ApiError) || asked !== this.asked) return
      this.isGood = false
      this.said.textContent = error.sentence
    }
  }

  #change(change) {
    this.protocol = { ...this.protocol, ...change }
    this.#soon({ protocol: this.protocol })
  }

  #draw() {
    const { protocol, choices } = this
    const tasks = new Map(protocol.tasks.map((task) => [task.task, task]))
    const setTask = (name, change) => this.#change({ tasks: choices.tasks.flatMap(({ name: each }) => {
      const task = { ...(tasks.get(each) ?? (each === name ? { task: each } : null)), ...(each === name ? change : {}) }
      return task.task === undefined || task.off ? [] : [task]
    }) })
    const redraw = () => setTimeout(() => this.#draw(), 2 * WAIT_MS)
    this.form.replaceChildren(
      this.#text('Title', protocol.title, (title) => this.#change({ title })),
      html('fieldset', { class: 'card' }, html('legend', {}, 'Tasks'), choices.tasks.map(({ name, title }) => {
        const task = tasks.get(name)
        return html('div', { class: 'bar' },
          this.#box(title, task !== undefined, (on) => { setTask(name, on ? { task: name } : { off: true }); redraw() }),
          task && this.#number('Questions', task.labels, 5, 100, (labels) => { task.labels = labels; setTask(name, { labels }) }),
          task && this.#number('Seconds', task.time_limit_s ?? '', 1, 3600, (time_limit_s) => { task.time_limit_s = time_limit_s; setTask(name, { time_limit_s }) }))
      })),
      html('fieldset', { class: 'card' }, html('legend', {}, 'Ways of steering compared'), html('div', { class: 'bar' }, choices.strategies.map(({ name }) =>
        this.#box(name, protocol.strategies.includes(name), (on) => {
          const strategies = choices.strategies.map((each) => each.name).filter((each) => (each === name ? on : this.protocol.strategies.includes(each)))
          this.#change({ strategies })
        })))),
      html('div', { class: 'bar' },
        html('label', {}, 'Order', html('select', { onchange: (event) => this.#change({ order: event.target.value }) },
          choices.orders.map(({ name, title }) => html('option', { value: name, selected: name === protocol.order }, title)))),
        this.#number('Tries each', protocol.drives, 1, 20, (drives) => this.#change({ drives })),
        this.#number('Participants', protocol.participants ?? '', 1, 100000, (participants) => this.#change({ participants })),
        this.#number('Practice, s', protocol.practice_s, 0, 3600, (practice_s) => this.#change({ practice_s }))),
      html('label', {}, 'Consent (Markdown)', html('textarea', { rows: 6, oninput: (event) => this.#change({ consent: event.target.value }) }, protocol.consent)),
      this.#text('Completion code', protocol.completion.code ?? '', (code) => this.#change({ completion: { ...this.protocol.completion, code: code || null } })))
  }

  #text(words, value, set) {
    return html('label', {}, words, html('input', { value, maxlength: 300, oninput: (event) => set(event.target.value) }))
  }

  #number(words, value, min, max, set) {
    return html('label', { class: 'small' }, words, html('input', { type: 'number', value, min, max, oninput: (event) => set(event.target.value === '' ? null : Number(event.target.value)) }))
  }

  #box(words, checked, set) {
    return html('label', { class: 'bar' }, html('input', { type: 'checkbox', checked, onchange: (event) => set(event.target.checked) }), words)
  }
}
