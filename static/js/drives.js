// drives.js — the page of one participant's drives.
import { Api, ApiError } from './api.js'
import { Banners } from './banners.js'
import { STRATEGIES, endInWords, measuresInWords } from './drive_words.js'
import { html } from './element.js'
import { counted } from './words.js'

const api = new Api(location.pathname.replace(/\/participants\/[^/]*$/, '/api'))
const banners = new Banners(document.getElementById('banners'))
const id = location.pathname.split('/').pop()

try {
  const { label, drives } = await api.get(`participants/${id}/drives`)
  document.getElementById('title').textContent = `Drives of ${label}`
  document.getElementById('summary').textContent = drives.length === 0 ? 'Nothing was driven yet.' : counted(drives.length, 'drive')
  if (drives.length > 0) document.getElementById('drives').replaceChildren(table(drives))
} catch (error) {
  if (!(error instanceof ApiError)) throw error
  banners.show('server', error.sentence)
}
document.body.dataset.ready = 'true'

function table(drives) {
  const measured = drives.map(({ measures }) => new Map(measures === null ? [] : measuresInWords(measures)))
  const names = [...new Set(measured.flatMap((words) => [...words.keys()]))]
  const columns = ['Strategy', 'End', ...names, 'Replay']
  return html('table', { class: 'table drives-table', 'data-testid': 'drives' },
    html('thead', {}, html('tr', {}, html('th', { scope: 'col' }, 'Began'), columns.map((name) => html('th', { scope: 'col' }, name)))),
    html('tbody', {}, drives.map((drive, index) => line(drive, columns, names.map((name) => measured[index].get(name) ?? '–')))))
}

function line({ id: drive, strategy, started_at, end, ticks }, columns, values) {
  const began = new Date(started_at)
  const look = ticks === 0 ? 'nothing recorded' : html('a', { href: `../drives/${drive}`, 'data-testid': 'replay' }, 'Look')
  const cells = [STRATEGIES[strategy] ?? strategy, endInWords(end), ...values, look]
  return html('tr', {},
    html('th', { scope: 'row' }, html('time', { datetime: started_at }, began.toLocaleString([], { month: 'short', day: 'numeric', hour: '2-digit', minute: '2-digit', second: '2-digit' }))),
    cells.map((cell, index) => html('td', { 'data-label': columns[index] }, cell)))
}
