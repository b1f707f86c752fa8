// attempt_panel.js — a task that has an end: what to do, how far it is, the clock, and how it ended.
import { html } from './element.js'
import { clockTime } from './words.js'

/**
 * @typedef {object} Progress
 * @property {string} title
 * @property {string} phase of the task, for programs; `says` is the same for people
 * @property {number} fraction
 * @property {string} says
 * @property {Record<string, number>} counts
 * @property {number} elapsed_s
 * @property {number | null} limit_s
 * @property {boolean} can_grasp
 * @property {null | 'done' | 'given up' | 'time limit'} end
 * @property {boolean} is_success
 */

const ENDS = { 'given up': 'Given up.', 'time limit': 'The time is up.' }

export class AttemptPanel {
  /** @param {{onGrasp: () => void, onGiveUp: () => void, onAgain: () => void}} actions */
  constructor({ onGrasp, onGiveUp, onAgain }) {
    this.says = html('p', { class: 'attempt-says', role: 'status', 'data-testid': 'attempt-says' })
    this.bar = html('progress', { max: 1, value: 0, 'aria-label': 'Progress' })
    this.clock = html('span', { class: 'attempt-clock', 'data-testid': 'attempt-clock', 'aria-label': 'Time' })
    this.counts = html('ul', { class: 'attempt-counts', 'data-testid': 'attempt-counts' })
    this.grasp = html('button', { class: 'button primary', type: 'button', 'data-testid': 'grasp', 'aria-keyshortcuts': 'Space', hidden: true, onclick: onGrasp }, 'Grasp')
    this.giveUp = html('button', { class: 'button plain-text', type: 'button', 'data-testid': 'give-up', hidden: true, onclick: onGiveUp }, 'Give up')
    this.again = html('button', { class: 'button primary', type: 'button', 'data-testid': 'again', hidden: true, onclick: onAgain }, 'Try again')
    this.element = html('section', { class: 'attempt', 'aria-label': 'The task', hidden: true },
      html('div', { class: 'attempt-head' }, this.says, this.clock),
      this.bar, this.counts,
      this.grasp, this.again)
    this.words = ''
    /** Whether one that is over may be tried once more. */
    this.mayTryAgain = true
  }

  /** @param {Progress | null} progress */
  draw(progress) {
    this.element.hidden = progress === null
    this.giveUp.hidden = progress === null
    if (progress === null) return
    const { end, says, counts } = progress
    write(this.says, end === null || end === 'done' ? says : ENDS[end])
    this.element.dataset.end = end === null ? '' : progress.is_success ? 'success' : 'over'
    this.bar.value = progress.fraction
    write(this.clock, clockTime(progress.elapsed_s) + (progress.limit_s === null ? '' : ` of ${clockTime(progress.limit_s)}`))
    const words = JSON.stringify(counts)
    if (words !== this.words) {
      this.words = words
      this.counts.replaceChildren(...Object.entries(counts).map(([name, count]) => html('li', {}, html('b', {}, String(count)), ` ${name}`)))
    }
    this.grasp.hidden = end !== null || !progress.can_grasp
    this.giveUp.hidden = end !== null
    this.again.hidden = end === null || !this.mayTryAgain
  }
}

function write(element, words) {
  if (element.textContent !== words) element.textContent = words
}
