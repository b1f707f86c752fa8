// way.js — the five steps at the top of the page.
import { html } from './element.js'

const STEPS = { consent: 'Welcome', practice: 'Practise', queries: 'Show', training: 'Learn', driving: 'Drive' }

export class Way {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host
  }

  /** @param {keyof typeof STEPS} step */
  show(step) {
    const names = Object.keys(STEPS)
    const here = names.indexOf(step)
    this.host.replaceChildren(html('ol', {}, names.map((name, index) =>
      html('li', { class: index < here ? 'done' : null, 'aria-current': index === here ? 'step' : null }, html('span', {}, STEPS[name])))))
    document.title = `${STEPS[step]} – Joymap`
  }
}
