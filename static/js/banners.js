// banners.js — short sentences at the top of the page, each under a name, until taken back.
import { html } from './element.js'

export class Banners {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host
    /** @type {Map<string, {element: HTMLElement, sentence: string, timer: number}>} */
    this.shown = new Map()
  }

  /**
   * @param {string} name
   * @param {string} sentence
   * @param {{button?: string, testid?: string, onPress?: () => void, for_ms?: number}} [options]
   */
  show(name, sentence, { button, testid, onPress, for_ms } = {}) {
    const before = this.shown.get(name)
    if (before?.sentence === sentence && !for_ms) return
    this.clear(name)
    const action = button && html('button', { class: 'button', type: 'button', 'data-testid': testid, onclick: onPress }, button)
    const element = html('div', { class: 'banner', 'data-testid': 'banner', 'data-banner': name }, html('span', {}, sentence), action)
    const timer = for_ms ? setTimeout(() => this.clear(name), for_ms) : 0
    this.shown.set(name, { element, sentence, timer })
    this.host.append(element)
  }

  /** @param {string} name */
  clear(name) {
    const before = this.shown.get(name)
    if (!before) return
    clearTimeout(before.timer)
    before.element.remove()
    this.shown.delete(name)
  }
}
