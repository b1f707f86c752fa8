// participants_table.js — who takes part and how far they are.
import { html } from './element.js'
import { durationInWords } from './words.js'

/** @typedef {{id: string, label: string, created_at: string, step: string, answers: number, training: string | null, drives: number, driven_s: number}} Participant */

const STEPS = { consent: 'Welcome', practice: 'Practising', queries: 'Answering', training: 'Learning', driving: 'Driving', 'not opened': 'Not opened yet' }
const TRAININGS = { queued: 'Waiting', running: 'Running', succeeded: 'Done', failed: 'Failed' }
const COLUMNS = ['Participant', 'Step', 'Answers', 'Learning', 'Drives', 'Driven', 'Since']

export class ParticipantsTable {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host
    this.shown = ''
  }

  /** @param {Participant[]} participants */
  draw(participants) {
    const key = JSON.stringify(participants)
    if (key === this.shown) return
    this.shown = key
    if (participants.length === 0) {
      this.host.replaceChildren(html('div', { class: 'empty', 'data-testid': 'empty' },
        html('h2', {}, 'Nobody takes part yet'),
        html('p', { class: 'quiet' }, 'Make a participant link and send it to someone. Their progress appears here by itself.')))
      return
    }
    this.host.replaceChildren(html('table', { class: 'table' },
      html('thead', {}, html('tr', {}, COLUMNS.map((name) => html('th', { scope: 'col' }, name)))),
      html('tbody', {}, participants.map(line))))
  }
}

/** @param {Participant} participant */
function line({ id, label, created_at, step, answers, training, drives, driven_s }) {
  const since = new Date(created_at)
  const learning = training === null ? '–' : (TRAININGS[training] ?? training)
  const cells = [
    html('span', { class: 'chip', 'data-step': step }, STEPS[step] ?? step), String(answers),
    html('span', { 'data-training': training }, learning),
    drives === 0 ? '0' : html('a', { href: `participants/${id}`, 'aria-label': `Drives of ${label}: ${drives}` }, String(drives)), drives === 0 ? '–' : durationInWords(driven_s),
    html('time', { datetime: created_at, title: since.toLocaleString() }, since.toLocaleString([], { dateStyle: 'medium', timeStyle: 'short' })),
  ]
  return html('tr', { 'data-id': id, 'data-testid': `participant-${label}` },
    html('th', { scope: 'row' }, label), cells.map((cell, index) => html('td', { 'data-label': COLUMNS[index + 1] }, cell)))
}
