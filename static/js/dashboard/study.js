// study.js — one study: its link, its people, its protocol.
import { html } from '../element.js'
import { newId } from '../ids.js'
import { counted } from '../words.js'
import { Figures } from './figures.js'
import { linkCard } from './link_card.js'
import { ROOT, api, attempt, keep, may, whoAmI } from './office.js'
import { ParticipantsTable } from './participants_table.js'
import { ProtocolEditor } from './protocol_editor.js'

const REFRESH_MS = 2000
const PAGE = 50

const id = location.pathname.split('/').pop()
const at = (name) => document.getElementById(name)
const table = new ParticipantsTable(at('participants'))
const view = { state: '', q: '', after: [0] }
const me = await whoAmI()
const isHelper = may(me, 'assistant')

function links(made) {
  at('links').replaceChildren(...made.map((each) => linkCard(each, (card) => card.remove())))
  at('links').querySelector('input')?.focus()
}

async function addPeople() {
  const count = Number(at('count').value) || 1
  const made = await attempt(() => api.postSurely(`studies/${id}/participants`, { id: newId(), count }))
  if (made) links(made.participants)
}

async function makeLink() {
  const made = await attempt(() => api.post(`studies/${id}/link`, {}))
  if (made) links([{ label: 'everyone who may take part', ...made }])
}

async function toggle(state) {
  await attempt(() => api.post(`studies/${id}/state`, { state }))
}

async function edit() {
  const [study, choices] = (await attempt(() => Promise.all([api.get(`studies/${id}`), api.get('choices')]))) ?? []
  if (!study) return
  const editor = new ProtocolEditor(api, choices, study.protocol)
  at('protocol').replaceChildren(
    study.is_frozen && html('p', { class: 'note' }, `People take part under version ${study.version}. What you change becomes version ${study.version + 1}, for those who come after.`),
    editor.element,
    isHelper && html('div', { class: 'bar' }, html('button', { class: 'button primary', type: 'button', 'data-testid': 'save-protocol', onclick: async () => {
      if (await attempt(() => api.put(`studies/${id}/protocol`, editor.content))) at('protocol').replaceChildren(html('p', { class: 'note' }, 'Saved.'))
    } }, 'Save the protocol'), html('button', { class: 'button plain-text', type: 'button', onclick: () => at('protocol').replaceChildren() }, 'Close')))
}

at('add').addEventListener('click', addPeople)
at('share').addEventListener('click', makeLink)
at('edit').addEventListener('click', edit)
for (const name of ['add', 'share', 'count-label']) at(name).hidden = !isHelper
at('export').href = `${ROOT}/api/v1/studies/${id}/export`
at('state').addEventListener('change', () => {
  view.state = at('state').value
  view.after = [0]
})
at('q').addEventListener('input', () => {
  view.q = at('q').value
  view.after = [0]
})
at('earlier').addEventListener('click', () => view.after.length > 1 && view.after.pop())
at('later').addEventListener('click', () => view.next && view.after.push(view.next))

if (id !== 'demo') new Figures(at('figures'), api, ROOT, id)
else at('figures').hidden = true

let shown = ''
void keep(REFRESH_MS, async () => {
  const study = await api.get(`studies/${id}`)
  const asked = new URLSearchParams({ limit: String(PAGE), after: String(view.after.at(-1)) })
  if (view.state) asked.set('state', view.state)
  if (view.q) asked.set('q', view.q)
  const page = await api.get(`studies/${id}/participants?${asked}`)
  view.next = page.next
  table.draw(page.participants)
  at('earlier').disabled = view.after.length === 1
  at('later').disabled = page.next === null
  at('total').textContent = counted(page.total, 'participant')
  const key = JSON.stringify(study)
  if (key === shown) return
  shown = key
  document.title = `${study.title} – Joymap`
  at('title').textContent = study.id === 'demo' ? 'To try Joymap out' : study.title
  const { completed, active, abandoned, withdrawn } = study.participants
  at('summary').textContent = `${study.state === 'open' ? 'Open' : 'Closed'} · protocol version ${study.version} · ${completed} done, ${active} under way, ${abandoned} gone, ${withdrawn} withdrew${study.wanted === null ? '' : ` · ${study.wanted} wanted`}${study.has_link ? ' · has a shared link' : ''}`
  at('edit').hidden = study.id === 'demo'
  at('door').replaceChildren(isHelper ? html('button', { class: 'button', type: 'button', 'data-testid': 'door', onclick: () => toggle(study.state === 'open' ? 'closed' : 'open') }, study.state === 'open' ? 'Close the study' : 'Open the study') : '')
})
