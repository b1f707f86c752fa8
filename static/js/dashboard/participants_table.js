// participants_table.js — who takes part in a study and how far they are, a page at a time.
import { html } from '../element.js'
import { durationInWords } from '../words.js'
import { ROOT, moment } from './office.js'

const TRAININGS = { queued: 'Waiting', running: 'Running', succeeded: 'Done', failed: 'Failed' }
const STATES = { active: '', completed: 'Done', abandoned: 'Gone', withdrawn: 'Withdrew' }
const COLUMNS = ['Participant', 'Step', 'Answers', 'Learning', 'Drives', 'Driven', 'Seen']

export class ParticipantsTable {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host
    this.shown = ''
  }

  draw(participants) {
    const key = JSON.stringify(participants)
    if (key === this.shown) return
    this.shown = key
    if (participants.length === 0) {
      this.host.replaceChildren(html('div', { class: 'empty', 'data-testid': 'empty' },
        html('h2', {}, 'Nobody here yet'),
        html('p', { class: 'quiet' }, 'Make a link and send it to someone. Their progress appears here by itself.')))
      return
    }
    this.host.replaceChildren(html('table', { class: 'table' },
      html('thead', {}, html('tr', {}, COLUMNS.map((name) => html('th', { scope: 'col' }, name)))),
      html('tbody', {}, participants.map(line))))
  }
}

function line(person) {
  const { id, label, step, place, of, state, is_opened, is_connected, excluded, answers, training, drives, driven_s, seen_at } = person
  const words = STATES[state] || (is_opened ? step.title : 'Not opened yet')
  const cells = [
    html('span', {}, html('span', { class: 'chip', 'data-step': step.kind }, words), state === 'active' && is_opened ? html('span', { class: 'quiet small' }, ` ${place}/${of}`) : '', is_connected ? html('span', { class: 'small' }, ' ● here') : '', excluded ? html('span', { class: 'bad small' }, ' excluded') : ''),
    String(answers),
    html('span', { 'data-training': training }, training === null ? '–' : (TRAININGS[training] ?? training)),
    String(drives), drives === 0 ? '–' : durationInWords(driven_s),
    moment(seen_at),
  ]
  return html('tr', { 'data-id': id, 'data-testid': `participant-${label}` },
    html('th', { scope: 'row' }, html('a', { href: `${ROOT}/participants/${id}` }, label)), cells.map((cell, index) => html('td', { 'data-label': COLUMNS[index + 1] }, cell)))
}
