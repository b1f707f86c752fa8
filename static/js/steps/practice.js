// practice.js — about a minute with the stick alone: a dot follows it to one target after the other.
import { html, svg } from '../element.js'
import { newId } from '../ids.js'
import { PracticeGame, REACH } from '../practice_game.js'
import { StickDialog } from '../stick_dialog.js'
import { StickInputs, eachFrame } from '../stick_inputs.js'
import { counted } from '../words.js'

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountPractice(root, { visit }) {
  const game = new PracticeGame()
  const body = { id: newId() }
  const stop = new AbortController()
  const began_ms = performance.now()
  const inputs = new StickInputs({
    visit,
    label: 'Joystick',
    hint: 'Push with the arrow keys or W, A, S, D. Two keys make a diagonal; hold Shift to push gently.',
  })

  const instruction = html('p', { class: 'practice-says', 'aria-live': 'polite' })
  const help = html('p', { class: 'quiet small practice-help' })
  const device = html('p', { class: 'quiet small', 'data-testid': 'device' })
  const count = html('p', { class: 'quiet small' })
  const time = html('progress', { max: 1, value: 0, 'aria-label': 'Time to practise' })
  const timeWords = html('p', { class: 'quiet small' })
  const state = html('p', { class: 'quiet small', role: 'status' })
  const ready = html('button', { class: 'button primary', type: 'button', 'data-testid': 'ready', onclick: finish }, 'I’m ready')
  const field = new Field()
  const stick = new StickDialog(visit, (isOpen) => (inputs.enabled = !isOpen))

  root.append(html('div', { class: 'practice' },
    html('div', { class: 'practice-head' },
      html('h1', { tabindex: -1 }, 'Get to know the stick'),
      html('p', { class: 'quiet practice-lead' }, 'Bring the dot into the circle. Use a mouse, a finger, the arrow keys or a gamepad.')),
    html('div', { class: 'practice-game' }, instruction, field.element, html('div', { class: 'practice-notes' }, count, help)),
    html('div', { class: 'practice-side' }, inputs.pad.element, html('div', { class: 'practice-device' }, device, stick.button),
      html('div', { class: 'practice-end' }, html('div', { class: 'practice-time' }, time, timeWords), ready, state))),
  stick.element)

  function say() {
    instruction.textContent = game.target.says
    count.textContent = game.reached === 0 ? 'The further you push, the further the dot goes.' : `${counted(game.reached, 'target')} reached`
  }

  function draw(now_ms, dt_s) {
    const h = inputs.readSteady(now_ms, dt_s)
    inputs.pad.draw(h)
    if (game.follow(h, dt_s)) say()
    field.draw(h, game)
    const name = inputs.deviceName
    device.textContent = name === null ? 'Waiting for your first push' : `You are using: ${name}`
    const isKeys = inputs.state.device === 'keys'
    help.textContent = isKeys && game.target.isGentle ? 'Hold Shift together with the arrow key.' : ''
    const gone_s = (now_ms - began_ms) / 1000
    const left_s = Math.max(0, Math.ceil(visit.session.practice_s - gone_s))
    time.value = Math.min(1, gone_s / visit.session.practice_s)
    timeWords.textContent = left_s > 0 ? `${left_s} s to try it out. Go on whenever you like.` : 'Take the time you need, then go on.'
  }

  async function finish() {
    ready.disabled = true
    state.textContent = 'One moment…'
    const onTrouble = () => (state.textContent = 'Not saved yet, trying again…')
    try {
      visit.adopt(await visit.api.postSurely('practice', body, { signal: stop.signal, onTrouble }))
    } catch (error) {
      ready.disabled = false
      state.textContent = ''
      visit.explain(error)
    }
  }

  say()
  const stopDrawing = eachFrame(draw)
  return () => {
    stop.abort()
    stopDrawing()
    inputs.close()
    stick.close()
  }
}

/** The round field with the dot and its target. */
class Field {
  constructor() {
    this.target = svg('circle', { class: 'game-target', r: REACH })
    this.fill = svg('circle', { class: 'game-fill', r: 0 })
    this.trail = svg('line', { class: 'game-trail', x1: 0, y1: 0 })
    this.dot = svg('circle', { class: 'game-dot', r: 0.075 })
    this.element = svg('svg', { class: 'game', viewBox: '-1.3 -1.3 2.6 2.6', 'aria-hidden': 'true' },
      svg('circle', { class: 'game-ground', r: 1.28 }), svg('circle', { class: 'game-ring', r: 1 }),
      svg('circle', { class: 'game-ring', r: 0.5 }), svg('circle', { class: 'game-middle', r: 0.02 }),
      this.target, this.fill, this.trail, this.dot)
  }

  draw(h, { target, fraction }) {
    for (const circle of [this.target, this.fill]) place(circle, 'c', target)
    this.fill.setAttribute('r', String(REACH * fraction))
    place(this.dot, 'c', h)
    this.trail.setAttribute('x2', String(h.x))
    this.trail.setAttribute('y2', String(-h.y))
  }
}

function place(circle, prefix, { x, y }) {
  circle.setAttribute(`${prefix}x`, String(x))
  circle.setAttribute(`${prefix}y`, String(-y))
}
