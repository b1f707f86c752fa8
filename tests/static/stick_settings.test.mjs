// A person's own stick: inverted, amplified, held to one axis, steadied, and let go at once all the same.
import assert from 'node:assert/strict'
import test from 'node:test'
import { AnswerMark } from '../../static/js/answer_mark.js'
import { Api, ApiError } from '../../static/js/api.js'
import { CENTRE, StickState, deflection } from '../../static/js/joystick.js'
import { isTaken } from '../../static/js/keys.js'
import { NORMAL, STEADY_S, SteadyStick, adjust, areSame, pushInWords } from '../../static/js/stick_settings.js'

const DEVICES = ['pointer', 'keys', 'gamepad']
const near = (found, wanted) => assert.ok(Math.hypot(found.x - wanted.x, found.y - wanted.y) < 1e-6, JSON.stringify([found, wanted]))
const set = (changes) => ({ ...NORMAL, ...changes })
const stateWith = (changes) => Object.assign(new StickState(), { settings: set(changes) })

test('nothing is changed until the person changes it', () => {
  for (const device of DEVICES) near(adjust({ x: 0.3, y: -0.4 }, device, NORMAL), { x: 0.3, y: -0.4 })
})
test('keys and gamepads can be inverted; a pointer means where it is', () => {
  const h = { x: 0.3, y: -0.4 }
  for (const device of ['keys', 'gamepad']) {
    near(adjust(h, device, set({ invert_x: true })), { x: -0.3, y: -0.4 })
    near(adjust(h, device, set({ invert_y: true })), { x: 0.3, y: 0.4 })
  }
  near(adjust(h, 'pointer', set({ invert_x: true, invert_y: true })), h)
})
test('who can push a third of the way gets the whole range, in the same direction, and no more', () => {
  for (const device of DEVICES) {
    near(adjust({ x: 0.2, y: 0.2 * Math.SQRT2 / 2 }, device, set({ gain: 2 })), { x: 0.4, y: 0.2 * Math.SQRT2 })
    near(adjust({ x: 0.2, y: -0.2666666667 }, device, set({ gain: 3 })), { x: 0.6, y: -0.8 })
    assert.ok(Math.abs(deflection(adjust({ x: 0.9, y: 0.3 }, device, set({ gain: 4 }))) - 1) < 1e-9)
  }
})
test('of two directions the larger counts, as far as it is pushed', () => {
  for (const device of DEVICES) {
    near(adjust({ x: 0.6, y: 0.3 }, device, set({ one_axis: true })), { x: 0.6, y: 0 })
    near(adjust({ x: -0.2, y: -0.3 }, device, set({ one_axis: true })), { x: 0, y: -0.3 })
  }
  near(adjust({ x: 0.3, y: 0.3 - 1e-9 }, 'gamepad', set({ one_axis: true, gain: 4 })), { x: 1, y: 0 })
})
test('at the diagonal one direction does not flicker into the other, well off it the other takes over', () => {
  const settings = set({ one_axis: true })
  const turn = (degrees, before) => adjust({ x: Math.cos((degrees * Math.PI) / 180), y: Math.sin((degrees * Math.PI) / 180) }, 'gamepad', settings, before)
  let h = turn(30)
  for (const degrees of [44, 46, 43, 48, 44, 50]) {
    h = turn(degrees, h)
    assert.equal(h.y, 0)
  }
  h = turn(56, h)
  assert.equal(h.x, 0)
  for (const degrees of [46, 44, 40]) {
    h = turn(degrees, h)
    assert.equal(h.x, 0)
  }
  assert.equal(turn(30, h).y, 0)
})
test('whatever is set, a stick let go is zero at once, on every device', () => {
  const settings = { invert_x: true, invert_y: true, gain: 4, one_axis: true, steady: true }
  const release = {
    pointer: (state) => state.movePointer(null),
    keys: (state) => state.release('ArrowUp'),
    gamepad: (state) => state.moveGamepad(CENTRE),
  }
  const push = {
    pointer: (state) => state.movePointer({ x: 0.5, y: 0.1 }),
    keys: (state) => state.press('ArrowUp'),
    gamepad: (state) => state.moveGamepad({ x: 0.5, y: 0.1 }),
  }
  for (const device of DEVICES) {
    const state = stateWith(settings)
    const shown = new SteadyStick()
    state.read(0)
    push[device](state)
    for (let i = 1; i <= 30; i += 1) shown.follow(state.read(16 * i), 0.016, true)
    assert.ok(deflection(shown.h) > 0.5, device)
    release[device](state)
    assert.equal(deflection(state.read(500)), 0, device)
    assert.equal(deflection(shown.follow(state.read(500), 0.016, true)), 0, device)
  }
})
test('a state gives each device by the settings', () => {
  const state = stateWith({ invert_x: true, invert_y: true, gain: 2 })
  state.movePointer({ x: 0.3, y: 0.1 })
  near(state.read(0), { x: 0.6, y: 0.2 })
  state.moveGamepad({ x: 0.3, y: 0.1 })
  near(state.read(1), { x: -0.6, y: -0.2 })
  state.press('ArrowUp')
  near(state.read(1001), { x: 0, y: -1 })
})
test('a gamepad held still keeps to itself, however it is set', () => {
  const state = stateWith({ invert_x: true, gain: 3 })
  state.moveGamepad({ x: 0.3, y: 0 })
  state.movePointer({ x: 0, y: 0.2 })
  state.moveGamepad({ x: 0.3, y: 0 })
  assert.equal(state.device, 'pointer')
})
test('answers are given with the same stick', () => {
  const answer = (changes, use) => {
    const mark = new AnswerMark()
    const state = stateWith(changes)
    use(state, mark)
    return mark.h
  }
  near(answer({ gain: 2 }, (state, mark) => {
    state.movePointer({ x: 0.3, y: 0.1 })
    mark.point(state.pointer)
  }), { x: 0.6, y: 0.2 })
  near(answer({ invert_y: true }, (state, mark) => {
    state.press('ArrowUp')
    for (let i = 0; i < 200; i += 1) mark.follow(state, 0.016, 16 * i)
  }), { x: 0, y: -1 })
})
test('with one direction at a time keys mark no slanting answer', () => {
  const mark = new AnswerMark()
  const state = stateWith({ one_axis: true })
  for (const code of ['ArrowRight', 'ArrowUp']) {
    state.press(code)
    for (let i = 0; i < 20; i += 1) mark.follow(state, 0.016, 16 * i)
    state.release(code)
    assert.ok(mark.h.x === 0 || mark.h.y === 0, JSON.stringify(mark.h))
  }
  assert.ok(mark.h.y > 0.2)
})
test('a gamepad in a hand that shakes can mark an answer once it is steadied', () => {
  const marked = (steady) => {
    const mark = new AnswerMark()
    const state = stateWith({ steady })
    for (let i = 0; i < 180; i += 1) {
      state.moveGamepad({ x: 0.6 + 0.2 * Math.sin((2 * Math.PI * 6 * i) / 60), y: 0 })
      mark.follow(state, 1 / 60, (1000 * i) / 60)
    }
    return mark.h
  }
  assert.equal(marked(false), null)
  assert.ok(Math.abs(marked(true).x - 0.6) < 0.1)
})
test('a steadied stick arrives, and takes most of a tremor out', () => {
  const steady = new SteadyStick()
  for (let i = 0; i < 60; i += 1) steady.follow({ x: 0.5, y: 0 }, STEADY_S / 15, true)
  assert.ok(Math.abs(steady.h.x - 0.5) < 0.01)
  const seen = []
  for (let i = 0; i < 120; i += 1) seen.push(steady.follow({ x: 0.5 + 0.2 * Math.sin((2 * Math.PI * 6 * i) / 60), y: 0 }, 1 / 60, true).x)
  const late = seen.slice(60)
  assert.ok(Math.max(...late) - Math.min(...late) < 0.4 * 0.12)
  near(steady.follow({ x: 1, y: 0 }, 1 / 60, false), { x: 1, y: 0 })
})
test('how far to push is told in words', () => {
  assert.equal(pushInWords(1), 'All the way')
  assert.equal(pushInWords(2), 'Half way')
  assert.equal(pushInWords(3), 'A third')
  assert.equal(pushInWords(4), 'A quarter')
  assert.equal(pushInWords(9), 'A quarter')
})
test('settings are the same when all of them are', () => {
  assert.ok(areSame(NORMAL, { ...NORMAL }))
  for (const change of [{ invert_x: true }, { invert_y: true }, { gain: 2 }, { one_axis: true }, { steady: true }]) assert.ok(!areSame(NORMAL, set(change)))
})
test('keys in a dialog are its own, except on its pad', () => {
  globalThis.Element ??= class {}
  const target = Object.assign(Object.create(Element.prototype), { closest: () => ({}) })
  assert.ok(isTaken({ target }))
  assert.ok(!isTaken({ target }, { contains: (node) => node === target }))
  assert.ok(isTaken({ target }, { contains: () => false }))
  assert.ok(isTaken({ target, ctrlKey: true }, { contains: () => true }))
})
test('a change is put until the server answers, the same each time; a refusal ends it', async () => {
  const sent = []
  const replies = [() => { throw new TypeError('no line') }, () => [503, '{}'], () => [200, '{"stick": {}}']]
  const api = new Api('base', (path, { method, body }) => {
    sent.push([path, method, body])
    const [status, content] = replies[sent.length - 1]()
    return Promise.resolve({ ok: status < 400, status, text: () => Promise.resolve(content) })
  })
  const troubles = []
  assert.deepEqual(await api.putSurely('stick', { id: 'a' }, { onTrouble: (error) => troubles.push(error.sentence) }), { stick: {} })
  assert.deepEqual(sent, Array(3).fill(['base/stick', 'PUT', '{"id":"a"}']))
  assert.equal(troubles[0], 'The server cannot be reached just now.')
  replies.push(() => [409, '{"error": {"sentence": "No.", "kind": "wrong-step"}}'])
  await assert.rejects(api.putSurely('stick', { id: 'b' }), (error) => error instanceof ApiError && error.sentence === 'No.')
})
