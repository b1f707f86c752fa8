// dashboard.js — the experimenter's page: wires the table and the button for new links.
import { Api, ApiError } from './api.js'
import { pause } from './backoff.js'
import { Banners } from './banners.js'
import { newId } from './ids.js'
import { linkCard } from './link_card.js'
import { ParticipantsTable } from './participants_table.js'
import { counted } from './words.js'

const REFRESH_MS = 2000

const api = new Api(location.pathname.replace(/\/dashboard\/?$/, '/api'))
const banners = new Banners(document.getElementById('banners'))
const table = new ParticipantsTable(document.getElementById('participants'))
const summary = document.getElementById('summary')
const button = document.getElementById('new-participant')
const card = document.getElementById('new-link')

async function refresh() {
  try {
    const { participants } = await api.get('participants')
    table.draw(participants)
    const driving = participants.filter(({ step }) => step === 'driving').length
    summary.textContent = participants.length === 0 ? 'Everyone you invite appears here.' : `${counted(participants.length, 'participant')}, ${driving} came as far as driving`
    banners.clear('server')
  } catch (error) {
    if (!(error instanceof ApiError)) throw error
    summary.textContent = ''
    const sentence = error.status === 401 ? 'Open the experimenter link that the server printed.' : error.sentence
    banners.show('server', sentence)
  }
  document.body.dataset.ready = 'true'
}

button.addEventListener('click', async () => {
  button.disabled = true
  try {
    const made = await api.postSurely('participants', { id: newId() }, { onTrouble: (error) => banners.show('new', error.sentence, { for_ms: 4000 }) })
    const element = linkCard(made, () => card.replaceChildren())
    card.replaceChildren(element)
    element.querySelector('input').focus()
    await refresh()
  } catch (error) {
    if (!(error instanceof ApiError)) throw error
    banners.show('new', error.sentence, { for_ms: 8000 })
  } finally {
    button.disabled = false
  }
})

for (;;) {
  if (document.visibilityState === 'visible') await refresh()
  await pause(REFRESH_MS)
}
