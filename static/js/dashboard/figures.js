// figures.js — a study's figures: drawn when asked for, and again as the study fills.
import { html } from '../element.js'
import { counted } from '../words.js'
import { attempt, keep, moment } from './office.js'

const LOOK_MS = 2000

export class Figures {
  /**
   * @param {HTMLDetailsElement} element  where they are; nothing is asked for while it is closed
   * @param {import('../api.js').Api} api
   * @param {string} root  what addresses begin with
   * @param {string} id  the study's
   */
  constructor(element, api, root, id) {
    this.element = element
    this.api = api
    this.path = `studies/${id}/figures`
    this.address = `${root}/api/v1/${this.path}`
    this.body = html('div', { 'data-testid': 'figures' }, html('p', { class: 'quiet' }, 'Asking for them…'))
    this.shown = ''
    element.append(this.body)
    void keep(LOOK_MS, () => (element.open ? this.look() : undefined))
  }

  async look() {
    let found = await this.api.get(this.path)
    if (!found.is_current && !found.is_drawing && !found.has_failed) found = await this.api.post(this.path, {})
    const key = JSON.stringify(found)
    if (key !== this.shown) this.draw(found)
    this.shown = key
  }

  draw(found) {
    const again = found.has_failed && html('button', { class: 'button', type: 'button', onclick: () => attempt(() => this.api.post(this.path, {})) }, 'Try again')
    this.body.replaceChildren(...[
      html('p', { class: 'quiet', role: 'status' }, ...this.status(found), ' ', again),
      found.findings.length > 0 && html('div', {},
        html('h2', {}, 'What differs'),
        html('ul', {}, ...found.findings.map((sentence) => html('li', {}, sentence))),
        html('p', { class: 'quiet small' }, `${found.test}.`)),
      ...found.pictures.map((picture) => html('figure', {},
        html('img', { src: `${this.address}/${picture.name}?at=${encodeURIComponent(found.drawn_at)}`, alt: `${picture.title}. ${picture.says}`, class: 'study-figure' }),
        html('figcaption', { class: 'quiet small' }, html('strong', {}, picture.title), ` ${picture.says}`))),
    ].filter(Boolean))
  }

  status(found) {
    if (found.has_failed) return ['The figures could not be drawn; the server’s log says why.']
    const now = found.is_drawing ? 'Drawing with the newest data: that takes some seconds, or minutes for a large study.' : ''
    if (found.drawn_at === null) return [now || 'Not drawn yet.']
    return ['Drawn ', moment(found.drawn_at), ` from ${counted(found.drives, 'drive')}. ${now}`]
  }
}
