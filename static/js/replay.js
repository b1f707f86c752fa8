// replay.js — the page of a replay: the picture, its controls, and what is known of the drive or move.
import { Api, ApiError } from './api.js'
import { Banners } from './banners.js'
import { WayPicture, stickPicture } from './drive_pictures.js'
import { HOLDS, endInWords, measuresInWords } from './drive_words.js'
import { html } from './element.js'
import { newId } from './ids.js'
import { Scene } from './scene.js'
import { LiveSocket } from './socket.js'
import { StickPad } from './stick_pad.js'
import { clockTime } from './words.js'

const SPEEDS = [0.25, 0.5, 1, 2, 4]
const here = location.pathname
const [kind, id] = here.split('/').slice(-2) // 'drives' or 'moves'
const view = newId()
const api = new Api(here.replace(/\/(drives|moves)\/[^/]*$/, '/api/v1'))
const banners = new Banners(document.getElementById('banners'))
const scene = new Scene(document.getElementById('stage'), `${here}/${view}/scene/`)

const play = html('button', { class: 'button primary', type: 'button', 'data-testid': 'play', 'aria-keyshortcuts': 'Space', onclick: () => toggle() }, 'Play')
const slider = html('input', { type: 'range', min: 0, max: 0, value: 0, step: 1, 'data-testid': 'slider', 'aria-label': 'Time', oninput: () => seek() })
const clock = html('span', { class: 'replay-clock', 'data-testid': 'clock' })
const speed = html('select', { 'aria-label': 'Speed', 'data-testid': 'speed', onchange: () => socket.send({ type: 'speed', speed: Number(speed.value) }) },
  SPEEDS.map((value) => html('option', { value: String(value), selected: value === 1 }, `${value} ×`)))
const says = html('p', { class: 'quiet', 'data-testid': 'says' })
const pad = new StickPad({ label: kind === 'moves' ? 'The stick they gave' : 'Where the stick was', hint: 'It shows what the person did.', name: 'replay', onMove: () => {} })
pad.enabled = false
let shown = null
let way = null

const socket = new LiveSocket(`${location.origin.replace('http', 'ws')}${here}/${view}/control`, {
  onOpen: () => banners.clear('line'),
  onClosed: () => banners.show('line', 'The line to the server is lost; trying again…'),
  onMessage: (message) => (message.type === 'status' ? draw(message) : banners.show('said', message.sentence, { for_ms: 4000 })),
})

function toggle() {
  socket.send({ type: shown?.is_playing ? 'pause' : 'play' })
}

function seek() {
  socket.send({ type: 'seek', tick: Number(slider.value) })
}

function draw(status) {
  shown = status
  slider.max = String(status.ticks - 1)
  if (document.activeElement !== slider || status.is_playing) slider.value = String(status.tick)
  slider.setAttribute('aria-valuetext', `${status.time_s.toFixed(1)} s of ${status.duration_s.toFixed(1)} s`)
  play.textContent = status.is_playing ? 'Pause' : 'Play'
  clock.textContent = `${clockTime(status.time_s)} of ${clockTime(status.duration_s)}`
  if (kind === 'drives') {
    const words = status.hold === null ? 'Moving' : HOLDS[status.hold]
    says.textContent = status.is_touching ? `${words}, touching` : words
  }
  pad.draw({ x: status.stick[0], y: status.stick[1] })
  way?.mark(status.hand)
  document.body.dataset.tick = String(status.tick)
}

addEventListener('keydown', (event) => {
  if (event.code !== 'Space' || event.repeat || event.ctrlKey || event.altKey || event.metaKey || event.target instanceof HTMLButtonElement || event.target instanceof HTMLSelectElement) return
  event.preventDefault()
  toggle()
})

function showDrive(found) {
  document.getElementById('summary').textContent = `${found.strategy_title} · ${new Date(found.started_at).toLocaleString()} · ${endInWords(found.end)}`
  document.getElementById('measures').replaceChildren(
    html('table', { class: 'measures', 'data-testid': 'measures' }, html('tbody', {}, measuresInWords(found.measures).map(([name, value]) =>
      html('tr', {}, html('th', { scope: 'row' }, name), html('td', {}, value))))),
    html('div', { class: 'drive-pictures' }, wayFigure(),
      html('figure', {}, stickPicture(found.stick_map), html('figcaption', { class: 'quiet small' }, 'Where the stick was'))))
}

function showMove(found) {
  document.getElementById('summary').textContent = `Move ${found.position} · ${found.is_answered ? 'the ghost shows where it ends' : 'not answered yet'}`
  says.textContent = found.h ? `They gave ${found.h[0].toFixed(2)} to the right and ${found.h[1].toFixed(2)} up.` : found.is_answered ? 'They could not say.' : ''
  document.getElementById('measures').replaceChildren(html('div', { class: 'drive-pictures' }, wayFigure()))
}

function wayFigure() {
  return html('figure', {}, way.element, html('figcaption', { class: 'quiet small' }, 'The hand from above, forward is up'))
}

scene.show()
document.getElementById('controls').replaceChildren(
  html('div', { class: 'replay-line' }, play, clock, speed, slider), html('div', { class: 'replay-stick' }, pad.element, says))
try {
  const found = await api.get(`${kind}/${id}`)
  const back = /** @type {HTMLAnchorElement} */ (document.getElementById('back'))
  back.href = `../participants/${found.participant_id}`
  back.textContent = `All of ${found.label}`
  document.getElementById('title').textContent = `${found.label}: ${found.task}`
  way = new WayPicture(found.path)
  if (kind === 'moves') showMove(found)
  else showDrive(found)
} catch (error) {
  if (!(error instanceof ApiError)) throw error
  banners.show('server', error.sentence)
}
document.body.dataset.ready = 'true'
