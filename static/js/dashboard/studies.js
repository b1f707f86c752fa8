// studies.js — all studies, and the way to a new one.
import { html } from '../element.js'
import { newId } from '../ids.js'
import { counted } from '../words.js'
import { ROOT, api, attempt, keep, may, whoAmI } from './office.js'
import { ProtocolEditor } from './protocol_editor.js'
import { Watch } from './watch.js'

const REFRESH_MS = 3000
const JOBS = 20

const list = document.getElementById('studies')
const summary = document.getElementById('summary')
const desk = document.getElementById('desk')
const button = document.getElementById('new-study')
const watch = new Watch(document.getElementById('live'), document.getElementById('jobs'))
let shown = ''

const me = await whoAmI()
button.hidden = !may(me, 'assistant')
button.addEventListener('click', async () => {
  button.hidden = true
  const choices = await attempt(() => api.get('choices'))
  if (!choices) {
    button.hidden = false
    return
  }
  const id = newId()
  const editor = new ProtocolEditor(api, choices, choices.template)
  const close = () => {
    desk.replaceChildren()
    button.hidden = false
  }
  desk.replaceChildren(html('section', { class: 'sheet-part', 'aria-label': 'A new study' },
    html('h2', { tabindex: -1 }, 'A new study'),
    editor.element,
    html('div', { class: 'bar' },
      html('button', { class: 'button primary', type: 'button', 'data-testid': 'make-study', onclick: async () => {
        const made = await attempt(() => api.post('studies', { id, ...editor.content }))
        if (made) location.assign(`${ROOT}/studies/${made.id}`)
      } }, 'Make the study'),
      html('button', { class: 'button plain-text', type: 'button', onclick: close }, 'Cancel'))))
  desk.querySelector('h2').focus()
})

void keep(REFRESH_MS, async () => {
  const { studies } = await api.get('studies')
  watch.draw(await api.get('live'), await api.get(`jobs?limit=${JOBS}`), studies)
  const key = JSON.stringify(studies)
  if (key === shown) return
  shown = key
  summary.textContent = counted(studies.length - 1, 'study', 'studies')
  list.replaceChildren(...studies.map(card))
})

function card({ id, title, state, version, participants, wanted }) {
  const people = participants.active + participants.completed
  const name = id === 'demo' ? 'To try Joymap out' : title
  return html('a', { class: 'card', href: `${ROOT}/studies/${id}`, 'data-testid': `study-${id}` },
    html('h2', {}, name),
    html('p', { class: 'quiet' }, state === 'open' ? 'Open' : 'Closed', version > 1 ? `, protocol version ${version}` : ''),
    html('p', {}, html('b', {}, String(participants.completed)), ' done, ', html('b', {}, String(participants.active)), ' under way',
      participants.withdrawn ? `, ${participants.withdrawn} withdrew` : '', participants.abandoned ? `, ${participants.abandoned} gone` : ''),
    wanted !== null && html('progress', { max: wanted, value: people, 'aria-label': `${people} of ${wanted} places taken` }),
    wanted !== null && html('p', { class: 'quiet small' }, `${people} of ${wanted} places taken`))
}
