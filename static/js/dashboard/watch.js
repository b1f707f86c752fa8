// watch.js — what goes on now, whoever's it is: arms that are live, and trainings.
import { html } from '../element.js'
import { durationInWords } from '../words.js'
import { ROOT, moment } from './office.js'

const MODES = { idle: 'at rest', showing: 'shows a move', driving: 'is driven' }
const STATES = { queued: 'Waiting', running: 'Running', succeeded: 'Done', failed: 'Failed' }

export class Watch {
  /** @param {HTMLElement} live @param {HTMLElement} jobs */
  constructor(live, jobs) {
    this.live = live
    this.jobs = jobs
    this.shown = {}
  }

  /** @param {{sessions: object[]}} lives @param {{jobs: object[], next: string | null}} trainings @param {{id: string, title: string}[]} studies */
  draw(lives, trainings, studies) {
    const titles = new Map(studies.map(({ id, title }) => [id, id === 'demo' ? 'To try Joymap out' : title]))
    this.#put('live', [lives.sessions, [...titles]], () => table(
      ['Participant', 'Study', 'Step', 'Arm', 'Attempt'], lives.sessions.map((each) => [each, live(each, titles)]), 'Nobody has an arm in front of them now.'))
    this.#put('jobs', [trainings.jobs, [...titles]], () => table(
      ['Participant', 'Study', 'Task', 'State', 'Took', 'Asked for'], trainings.jobs.map((each) => [each, job(each, titles)]), 'Nothing was learned yet.'))
  }

  #put(name, content, make) {
    const key = JSON.stringify(content)
    if (this.shown[name] === key) return
    this.shown[name] = key
    // A link that has the keyboard keeps it through a new drawing.
    const focused = this[name].contains(document.activeElement) ? document.activeElement.getAttribute('href') : null
    this[name].replaceChildren(make())
    if (focused) this[name].querySelector(`a[href="${focused}"]`)?.focus()
  }
}

function table(columns, lines, nothing) {
  if (lines.length === 0) return html('p', { class: 'quiet' }, nothing)
  return html('table', { class: 'table' },
    html('thead', {}, html('tr', {}, columns.map((name) => html('th', { scope: 'col' }, name)))),
    html('tbody', {}, lines.map(([{ participant_id, label }, cells]) => html('tr', {},
      html('th', { scope: 'row' }, html('a', { href: `${ROOT}/participants/${participant_id}` }, label)),
      cells.map((cell, index) => html('td', { 'data-label': columns[index + 1] }, cell))))))
}

function live({ study_id, step, mode, is_connected, progress }, titles) {
  const attempt = progress === null ? '–' : `${progress.says} ${durationInWords(progress.elapsed_s)}`
  return [titles.get(study_id) ?? '–', html('span', { class: 'chip', 'data-step': step.kind }, step.title), is_connected ? MODES[mode] : 'left alone', attempt]
}

function job({ study_id, task, state, fraction, error, training_s, queued_at }, titles) {
  const words = state === 'running' ? `${STATES[state]}, ${Math.round(100 * fraction)} %` : STATES[state]
  return [titles.get(study_id) ?? '–', task, html('span', { 'data-training': state, title: error ?? '' }, words), training_s === null ? '–' : durationInWords(training_s), moment(queued_at)]
}
