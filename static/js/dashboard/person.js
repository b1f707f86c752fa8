// person.js — one participant: what they did, said and drove, and what an experimenter does about it.
import { endInWords, measuresInWords } from '../drive_words.js'
import { html, svg } from '../element.js'
import { newId } from '../ids.js'
import { Scene } from '../scene.js'
import { counted, durationInWords } from '../words.js'
import { linkCard } from './link_card.js'
import { ROOT, api, attempt, keep, may, moment, whoAmI } from './office.js'

const REFRESH_MS = 3000

const id = location.pathname.split('/').pop()
const at = (name) => document.getElementById(name)
const me = await whoAmI()
const reason = html('input', { maxlength: 2000, 'aria-label': 'Reason or note', placeholder: 'Reason or note', 'data-testid': 'reason' })
const shown = { person: '', actions: '', drives: '' }
/** @type {Scene | null} */
let scene = null

function draw(person) {
  const key = JSON.stringify(person)
  if (key === shown.person) return
  shown.person = key
  document.title = `${person.label} – Joymap`
  at('title').textContent = person.label
  at('study').href = `${ROOT}/studies/${person.study_id}`
  at('summary').textContent = `${person.step.title} · step ${person.place} of ${person.of} · protocol version ${person.version}${person.is_connected ? ' · here now' : ''}`
  const facts = {
    State: person.excluded ? `${person.state}, excluded: ${person.excluded}` : person.state,
    Order: person.order.join(' → '),
    'External id': person.external_id ?? '–',
    'Consented': person.events.find(({ kind }) => kind === 'consent') ? moment(person.events.find(({ kind }) => kind === 'consent').at) : 'not yet',
    Seen: moment(person.seen_at),
  }
  for (const [task, { pairs, mean_angle_deg, mean_length_difference }] of Object.entries(person.consistency)) {
    const turn = mean_angle_deg === null ? '' : `${mean_angle_deg}° and `
    facts[`Consistency, ${task}`] = `${turn}${mean_length_difference} of the stick's way apart over ${counted(pairs, 'move')} asked twice`
  }
  at('facts').replaceChildren(...Object.entries(facts).flatMap(([name, value]) => [html('dt', {}, name), html('dd', {}, value)]))
  at('answers').replaceChildren(person.answers_given.length === 0 ? html('p', { class: 'quiet' }, 'Nothing was answered yet.') : html('ul', { class: 'cards' }, person.answers_given.map(answer)))
  at('trainings').replaceChildren(...(person.trainings.length === 0 ? [html('p', { class: 'quiet' }, 'Nothing was learned yet.')] : person.trainings.map(training)))
  at('responses').replaceChildren(person.responses.length === 0 ? html('p', { class: 'quiet' }, 'Nothing was asked yet.') : html('table', { class: 'table' },
    html('thead', {}, html('tr', {}, ['Step', 'Item', 'Response'].map((name) => html('th', { scope: 'col' }, name)))),
    html('tbody', {}, person.responses.map(({ step, item, value }) => html('tr', {}, html('td', { 'data-label': 'Step' }, step), html('td', { 'data-label': 'Item' }, item), html('td', { 'data-label': 'Response' }, value === null ? 'declined' : String(value)))))))
  at('notes').replaceChildren(...person.notes.map(({ author, text, written_at }) => html('p', { class: 'note' }, text, html('br', {}), html('span', { class: 'small' }, `${author}, `, moment(written_at)))))
  actions(person)
  if (!person.is_connected && scene) look()
  at('watching').hidden = !person.is_connected
  document.body.dataset.ready = 'true'
}

/** Show the arm that the participant has in front of them, or no longer. */
function look() {
  if (scene) {
    scene.close()
    scene = null
  } else {
    scene = new Scene(at('stage'), `${ROOT}/participants/${id}/live/scene/`)
    scene.show()
  }
  at('stage').hidden = scene === null
  at('look').setAttribute('aria-expanded', String(scene !== null))
  at('look').textContent = scene ? 'Look away' : 'Look at the arm'
}

function answer({ query_id, task, position, h, thinking_time_s, hand_path, repeats }) {
  const xs = hand_path.map(([x]) => x)
  const ys = hand_path.map(([, y]) => y)
  const zs = hand_path.map(([, , z]) => z)
  const size = Math.max(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys), Math.max(...zs) - Math.min(...zs), 0.02)
  const place = (value, values, flip) => 50 + (flip ? -1 : 1) * (80 * (value - (Math.max(...values) + Math.min(...values)) / 2)) / size
  const line = hand_path.map(([x, y]) => `${place(y, ys, true).toFixed(1)},${place(x, xs, true).toFixed(1)}`).join(' ')
  return html('li', { class: 'card' },
    html('b', {}, `${task}, move ${position}${repeats ? ' (asked again)' : ''}`),
    html('div', { class: 'bar' },
      svg('svg', { viewBox: '0 0 100 100', width: 72, height: 72, role: 'img', 'aria-label': 'The move from above' },
        svg('rect', { width: 100, height: 100, rx: 12, fill: 'var(--fill)' }),
        svg('polyline', { points: line, fill: 'none', stroke: 'var(--accent)', 'stroke-width': 4 }),
        svg('circle', { cx: line.split(' ')[0].split(',')[0], cy: line.split(' ')[0].split(',')[1], r: 5, fill: 'var(--accent)' })),
      svg('svg', { viewBox: '-1.2 -1.2 2.4 2.4', width: 72, height: 72, role: 'img', 'aria-label': 'The stick they gave' },
        svg('circle', { r: 1, fill: 'var(--fill)' }),
        h && svg('line', { x2: h[0], y2: -h[1], stroke: 'var(--accent)', 'stroke-width': 0.12 }),
        h && svg('circle', { cx: h[0], cy: -h[1], r: 0.16, fill: 'var(--accent)' }))),
    html('span', { class: 'quiet small' }, `${h ? `stick ${h[0].toFixed(2)}, ${h[1].toFixed(2)}` : 'could not say'} · ${durationInWords(thinking_time_s)}`),
    html('a', { href: `${ROOT}/moves/${query_id}`, 'data-testid': 'play-move', 'aria-label': `Play move ${position} of ${task}` }, 'Play the move'))
}

function training({ task, state, fraction, training_s, error, strategies }) {
  const curves = Object.entries(strategies).filter(([, { curve }]) => curve.length > 1)
  return html('div', { class: 'card' },
    html('b', {}, task), html('span', {}, state === 'succeeded' ? `learned in ${durationInWords(training_s)}` : `${state}, ${Math.round(100 * fraction)} %`, error ? `: ${error}` : ''),
    html('div', { class: 'bar' }, curves.map(([name, { curve }]) => figure(name, curve))))
}

function figure(name, curve) {
  const [first, last] = [curve[0][0], curve.at(-1)[0]]
  const low = Math.log(Math.min(...curve.map(([, loss]) => Math.max(loss, 1e-9))))
  const high = Math.log(Math.max(...curve.map(([, loss]) => Math.max(loss, 1e-9))))
  const points = curve.map(([step, loss]) => `${(140 * (step - first)) / (last - first || 1)},${60 - (56 * (Math.log(Math.max(loss, 1e-9)) - low)) / (high - low || 1)}`).join(' ')
  return html('figure', { class: 'small' },
    svg('svg', { viewBox: '-4 -2 150 66', width: 150, height: 66, role: 'img', 'aria-label': `Loss of ${name}, from ${curve[0][1]} to ${curve.at(-1)[1]}` }, svg('polyline', { points, fill: 'none', stroke: 'var(--accent)', 'stroke-width': 2 })),
    html('figcaption', { class: 'quiet' }, name))
}

function actions(person) {
  const tasks = [...new Set(person.trainings.map(({ task }) => task))]
  // What somebody is typing or about to press stays where it is.
  const key = JSON.stringify([person.state, person.excluded, tasks])
  if (key === shown.actions) return
  shown.actions = key
  const path = `participants/${id}`
  const act = (words, testid, role, action) => may(me, role) && html('button', { class: 'button', type: 'button', 'data-testid': testid, onclick: action }, words)
  const change = async (what, body = {}) => {
    const changed = await attempt(() => api.post(`${path}/${what}`, body))
    if (changed?.label) {
      reason.value = ''
      draw(changed)
    }
    return changed
  }
  at('actions').replaceChildren(
    may(me, 'assistant') ? reason : '',
    act('Add the note', 'note', 'assistant', () => change('notes', { id: newId(), text: reason.value })) || '',
    act(person.excluded ? 'Take in again' : 'Exclude', 'exclude', 'assistant', () => (person.excluded ? change('include') : change('exclude', { reason: reason.value }))) || '',
    act('New link', 'new-link', 'assistant', async () => {
      const made = await change('link')
      if (made) at('links').replaceChildren(linkCard({ label: person.label, ...made }, (card) => card.remove()))
    }) || '',
    act('End the link', 'revoke', 'assistant', () => change('revoke')) || '',
    ...tasks.map((task) => act(`Train ${task} again`, `retrain-${task}`, 'assistant', () => change('retrain', { task })) || ''),
    (person.state !== 'withdrawn' && act('Withdraw and erase', 'erase', 'owner', () => confirm(`Erase everything that ${person.label} gave? This cannot be undone.`) && change('withdraw', { id: newId(), erase: true }))) || '')
}

function drivesTable(drives) {
  const measured = drives.map(({ measures }) => new Map(measures === null ? [] : measuresInWords(measures)))
  const names = [...new Set(measured.flatMap((words) => [...words.keys()]))]
  const columns = ['Task', 'Strategy', 'End', ...names, 'Replay']
  return html('table', { class: 'table drives-table', 'data-testid': 'drives' },
    html('thead', {}, html('tr', {}, html('th', { scope: 'col' }, 'Began'), columns.map((name) => html('th', { scope: 'col' }, name)))),
    html('tbody', {}, drives.map(({ id: drive, task, strategy_title: strategy, started_at, end, ticks }, index) => {
      const look = ticks === 0 ? 'nothing recorded' : html('a', { href: `${ROOT}/drives/${drive}`, 'data-testid': 'replay' }, 'Look')
      const cells = [task, strategy, endInWords(end), ...names.map((name) => measured[index].get(name) ?? '–'), look]
      return html('tr', {}, html('th', { scope: 'row' }, moment(started_at)), cells.map((cell, column) => html('td', { 'data-label': columns[column] }, cell)))
    })))
}

at('look').addEventListener('click', look)
void keep(REFRESH_MS, async () => {
  draw(await api.get(`participants/${id}`))
  const { drives } = await api.get(`participants/${id}/drives`)
  const key = JSON.stringify(drives)
  if (key === shown.drives) return
  shown.drives = key
  at('drives').replaceChildren(drives.length === 0 ? html('p', { class: 'quiet' }, 'Nothing was driven yet.') : drivesTable(drives))
})
