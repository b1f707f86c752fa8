// The stick's pure parts: what a hand does on any device becomes one human input.
import assert from 'node:assert/strict'
import test from 'node:test'
import { AnswerMark, SteadyDeflection } from '../../static/js/answer_mark.js'
import { largestStick } from '../../static/js/gamepads.js'
import { CENTRE, StickState, deflection, fromGamepadAxes, keyDirection, toHumanInput } from '../../static/js/joystick.js'
import { PracticeGame, TARGETS } from '../../static/js/practice_game.js'
import { directionInWords, gamepadName, inWords } from '../../static/js/words.js'

const near = (found, wanted) => assert.ok(Math.hypot(found.x - wanted.x, found.y - wanted.y) < 1e-6, JSON.stringify([found, wanted]))
const pad = (axes, { mapping = 'standard', pressed = [] } = {}) =>
  ({ mapping, axes, buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: pressed.includes(i) })) })

test('a pointer outside the dead zone means just where it is, with up as forward', () => {
  near(toHumanInput(30, -40, 100), { x: 0.3, y: 0.4 })
})
test('a pointer beyond the edge is on the edge, in the same direction', () => near(toHumanInput(300, 400, 100), { x: 0.6, y: -0.8 }))
test('a pointer in the dead zone, or on a pad of no size, is at rest', () => {
  near(toHumanInput(4, 5, 100), CENTRE)
  near(toHumanInput(4, 5, 0), CENTRE)
})
test('a gamepad stick grows from zero at the dead zone to one at its end', () => {
  near(fromGamepadAxes(0.05, 0.05), CENTRE)
  assert.ok(deflection(fromGamepadAxes(0.081, 0)) < 0.01)
  near(fromGamepadAxes(0, -1), { x: 0, y: 1 })
  near(fromGamepadAxes(Number.NaN, 0), CENTRE)
})
test('the triggers of an unknown gamepad, which rest at -1, are no stick', () => {
  near(largestStick(pad([0, 0, -1, -1], { mapping: '' })), CENTRE)
})
test('the second stick and the cross steer as well', () => {
  near(largestStick(pad([0, 0, 1, 0])), { x: 1, y: 0 })
  near(largestStick(pad([0, 0, 0, 0], { pressed: [12] })), { x: 0, y: 1 })
})
test('opposite keys cancel and two keys make a diagonal of length one', () => {
  near(keyDirection(['KeyA', 'ArrowRight']), CENTRE)
  assert.ok(Math.abs(deflection(keyDirection(['ArrowUp', 'ArrowRight'])) - 1) < 1e-9)
})
test('a key tapped is gentle, held is full, let go is at once zero', () => {
  const state = new StickState()
  state.read(0)
  state.press('ArrowUp')
  near(state.read(75), { x: 0, y: 0.5 })
  near(state.read(400), { x: 0, y: 1 })
  state.release('ArrowUp')
  near(state.read(401), CENTRE)
})
test('shift with a key is half a push', () => {
  const state = new StickState()
  state.read(0)
  state.press('KeyD')
  state.isGentle = true
  near(state.read(500), { x: 0.5, y: 0 })
})
test('the device used last counts, and a gamepad lying still does not take over', () => {
  const state = new StickState()
  state.moveGamepad({ x: 1, y: 0 })
  near(state.read(0), { x: 1, y: 0 })
  state.movePointer({ x: 0, y: 0.5 })
  state.moveGamepad({ x: 1, y: 0 })
  near(state.read(1), { x: 0, y: 0.5 })
  state.movePointer(null)
  state.moveGamepad({ x: 1, y: 0 })
  near(state.read(2), CENTRE)
})
test('an answer dragged is where the pointer was last, whatever was drawn of its way, and stays there', () => {
  const mark = new AnswerMark()
  const state = new StickState()
  for (const h of [{ x: 0.2, y: 0.6 }, { x: -0.3, y: 0.9 }]) {
    state.movePointer(h)
    mark.point(state.pointer)
  }
  state.movePointer(null)
  near(mark.h, { x: -0.3, y: 0.9 })
  for (const now_ms of [16, 32]) mark.follow(state, 0.016, now_ms)
  near(mark.h, { x: -0.3, y: 0.9 })
})
test('keys carry the answer on from where it is, never over the edge', () => {
  const mark = new AnswerMark()
  const state = new StickState()
  state.press('ArrowUp')
  mark.tap({ x: 0, y: 1 })
  assert.ok(deflection(mark.h) > 0.08)
  for (let i = 0; i < 200; i += 1) mark.follow(state, 0.016, 16 * i)
  near(mark.h, { x: 0, y: 1 })
})
test('an answer brought back to the middle is no answer', () => {
  const mark = new AnswerMark()
  mark.set({ x: 0.05, y: 0 })
  assert.equal(mark.h, null)
})
test('of a gamepad push only what was held for a moment is marked, not the way there', () => {
  const steady = new SteadyDeflection()
  assert.equal(steady.feed({ x: 0.4, y: 0 }, 0), null)
  assert.equal(steady.feed({ x: 0.9, y: 0 }, 100), null)
  near(steady.feed({ x: 0.9, y: 0.02 }, 400), { x: 0.9, y: 0.02 })
  assert.equal(steady.feed({ x: 0.5, y: 0 }, 500), null)
  assert.equal(steady.feed({ x: 0.5, y: 0 }, 900), null)
})
test('practice asks to let go between targets', () => {
  const game = new PracticeGame()
  for (let i = 0; i < 10; i += 1) game.follow(TARGETS[0], 0.1)
  assert.equal(game.reached, 1)
  near(game.target, CENTRE)
  for (let i = 0; i < 10; i += 1) game.follow(CENTRE, 0.1)
  assert.equal(game.target, TARGETS[1])
})
test('positions are told in words', () => {
  assert.equal(inWords({ x: 0, y: 0 }), 'in the middle')
  assert.equal(inWords({ x: -0.15, y: 0.4 }), 'forward and a little left, half way')
  assert.equal(inWords({ x: 0.7, y: -0.7 }), 'back and right, all the way')
  assert.equal(directionInWords({ x: 1, y: 0.1 }), 'right')
})
test('a gamepad goes by its name without numbers', () => {
  assert.equal(gamepadName('Xbox Pad (STANDARD GAMEPAD Vendor: 045e Product: 02fd)'), 'Xbox Pad')
  assert.equal(gamepadName('045e-02fd-Xbox Pad'), 'Xbox Pad')
})
