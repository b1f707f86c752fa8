// way.js — the stages at the top of the page, as the server counts them.
import { html } from './element.js'

export class Way {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host
    this.shown = ''
  }

  /** @param {{title: string, is_here: boolean, is_done: boolean}[]} stages @param {string} study */
  show(stages, study) {
    const key = JSON.stringify(stages)
    if (key === this.shown) return
    this.shown = key
    this.host.replaceChildren(html('ol', { 'data-many': stages.length > 5 }, stages.map(({ title, is_here, is_done }) =>
      html('li', { class: is_done ? 'done' : null, 'aria-current': is_here ? 'step' : null }, html('span', {}, title)))))
    document.title = `${stages.find(({ is_here }) => is_here)?.title ?? study} – Joymap`
  }
}
