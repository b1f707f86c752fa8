// Gamepads that come and go: whatever one was pushed to ends with it.
import assert from 'node:assert/strict'
import test from 'node:test'
import { AnswerMark } from '../../static/js/answer_mark.js'
import { readGamepads } from '../../static/js/gamepads.js'
import { CENTRE, StickState, deflection } from '../../static/js/joystick.js'

const near = (found, wanted) => assert.ok(Math.hypot(found.x - wanted.x, found.y - wanted.y) < 1e-6, JSON.stringify([found, wanted]))
const pad = (x, y, changes = {}) =>
  ({ id: 'Test pad', connected: true, mapping: 'standard', axes: [x, -y, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false })), ...changes })

/** What the browser lists from now on. */
function list(pads) {
  Object.defineProperty(globalThis, 'navigator', { value: { getGamepads: pads }, configurable: true })
}

/** One reading of the gamepads, as a step takes it for each picture. */
function read(state, now_ms) {
  state.moveGamepad(readGamepads().h)
  return state.read(now_ms)
}

const WAYS_TO_GO = {
  'it is listed no more': () => [null, null],
  'nothing is listed': () => [],
  'it is listed as not connected': () => [pad(-0.6, 0.5, { connected: false })],
  'gamepads may not be read': () => { throw new TypeError('not allowed') },
}
for (const [how, pads] of Object.entries(WAYS_TO_GO)) {
  test(`a pushed gamepad that goes away lets the stick go: ${how}`, () => {
    const state = new StickState()
    list(() => [pad(-0.6, 0.5)])
    assert.ok(deflection(read(state, 0)) > 0.5)
    list(pads)
    near(read(state, 16), CENTRE)
  })
}
for (const [name, axes] of Object.entries({ 'not a number': [NaN, -1, 0, 0], 'not a number across': [1, NaN, 0, 0], infinite: [Infinity, 0, 0, 0], missing: [1] })) {
  test(`a pushed gamepad of which an axis is ${name} lets the stick go`, () => {
    const state = new StickState()
    list(() => [pad(-0.6, 0.5)])
    assert.ok(deflection(read(state, 0)) > 0.5)
    list(() => [pad(0, 0, { axes })])
    near(read(state, 16), CENTRE)
  })
}
test('a gamepad that goes away and comes back steers again', () => {
  const state = new StickState()
  for (const pads of [[pad(1, 0)], [null], [pad(1, 0)]]) {
    list(() => pads)
    near(read(state, 0), pads[0] ? { x: 1, y: 0 } : CENTRE)
  }
})
test('when one of two gamepads goes away only what the other is pushed to counts', () => {
  const state = new StickState()
  for (const other of [CENTRE, { x: 0, y: -1 }]) {
    list(() => [pad(1, 0), pad(other.x, other.y)])
    near(read(state, 0), { x: 1, y: 0 })
    list(() => [null, pad(other.x, other.y)])
    near(read(state, 16), other)
  }
})
test('a gamepad that goes away takes the stick from no other device', () => {
  const state = new StickState()
  list(() => [pad(1, 0)])
  read(state, 0)
  state.movePointer({ x: 0, y: 0.5 })
  list(() => [])
  near(read(state, 16), { x: 0, y: 0.5 })
})
test('a gamepad that goes away before its push was held marks nothing, and after that leaves the mark', () => {
  const mark = new AnswerMark()
  const state = new StickState()
  let now_ms = 0
  const draw = (pads, for_ms) => {
    list(() => pads)
    for (const end_ms = now_ms + for_ms; now_ms < end_ms; now_ms += 16) {
      read(state, now_ms)
      mark.follow(state, 0.016, now_ms)
    }
  }
  draw([pad(0, 1)], 100)
  draw([], 1000)
  assert.equal(mark.h, null)
  draw([pad(0, 1)], 500)
  near(mark.h, { x: 0, y: 1 })
  draw([], 1000)
  near(mark.h, { x: 0, y: 1 })
})
