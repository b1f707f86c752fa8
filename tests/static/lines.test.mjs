// The lines to the server, and the pictures: nothing is lost, nothing is sent twice under another id.
import assert from 'node:assert/strict'
import test from 'node:test'
import { Api, ApiError } from '../../static/js/api.js'
import { Backoff } from '../../static/js/backoff.js'
import { extentOf, spreadOut } from '../../static/js/chart.js'
import { arrowPaths, arrowScale, meanMove, toPaper } from '../../static/js/field_geometry.js'
import { newId } from '../../static/js/ids.js'
import { PictureScale } from '../../static/js/picture_scale.js'

const reply = (status, content) => ({ ok: status < 400, status, text: async () => (typeof content === 'string' ? content : JSON.stringify(content)) })

test('an answer is posted again with the same body until the server has it', async () => {
  const sent = []
  const api = new Api('/p/T/api', async (path, { body }) => {
    sent.push([path, body])
    if (sent.length === 1) throw new TypeError('no network')
    return sent.length === 2 ? reply(503, '<html>') : reply(201, { step: 'queries' })
  })
  let troubles = 0
  const session = await api.postSurely('answers', { id: 'a' }, { onTrouble: () => (troubles += 1) })
  assert.deepEqual(session, { step: 'queries' })
  assert.equal(troubles, 2)
  assert.deepEqual(new Set(sent.map(String)).size, 1)
})
test('a refusal is not tried again and carries its sentence', async () => {
  const api = new Api('', async () => reply(409, { error: { sentence: 'That is over.', kind: 'wrong-step' } }))
  await assert.rejects(api.postSurely('answers', {}), (error) => error instanceof ApiError && error.sentence === 'That is over.' && error.status === 409)
})
test('waits grow up to their limit', () => {
  const backoff = new Backoff(0.3, 5, () => 0.5)
  const waits = Array.from({ length: 10 }, () => backoff.step())
  assert.ok(waits.every((wait, i) => i === 0 || wait >= waits[i - 1]))
  assert.ok(Math.abs(waits.at(-1) - 5000) < 1)
})
test('ids are UUIDs also without a secure context', () => {
  const secure = crypto.randomUUID
  crypto.randomUUID = undefined
  try {
    assert.match(newId(), /^[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$/)
  } finally {
    crypto.randomUUID = secure
  }
})

const point = (at) => ({ at, up: [0.01, 0], down: [-0.01, 0], left: [0, 0.01], right: [0, -0.01] })
const arrows = [point([0.4, 0]), point([0.5, 0]), point([0.4, 0.1]), point([0.5, 0.1])]

test('forward is up the paper and left is left', () => {
  assert.ok(toPaper([1, 0])[1] < 0)
  assert.ok(toPaper([0, 1])[0] < 0)
  const { x, y } = meanMove(arrows, 'left')
  assert.ok(x < 0 && Math.abs(y) < 1e-12)
})
test('arrows reach half way to the next point and no arrow is drawn for no movement', () => {
  const scale = arrowScale([[{ fraction: 1, arrows }]])
  assert.ok(Math.abs(scale * 0.01 - 0.046) < 1e-9)
  assert.equal(arrowPaths(arrows, 'up', scale, 0.08).heads.split('Z').length - 1, 4)
  assert.equal(arrowPaths([{ ...arrows[0], up: [0, 0] }], 'up', scale, 0.08).heads, '')
})
test('names at the ends of curves do not overlap', () => {
  const [a, b] = spreadOut([100, 101], 20)
  assert.ok(Math.abs(a - b) >= 20)
  assert.deepEqual(extentOf([{ curve: [[0, 2], [10, 1]] }]), { step: 10, loss: 2 })
})
test('the picture gets coarser only where drawing is slow, and stops at a limit', () => {
  const fast = new PictureScale()
  for (let i = 0; i < 50; i += 1) assert.equal(fast.feed(17), false)
  const slow = new PictureScale()
  for (let i = 0; i < 50; i += 1) slow.feed(800)
  assert.equal(slow.scale, 0.3)
  const hiccup = new PictureScale()
  for (let i = 0; i < 50; i += 1) hiccup.feed(i % 5 === 0 ? 3000 : 17)
  assert.equal(hiccup.scale, 1)
})
test('a lost line is told once and comes back by itself', async () => {
  const { LiveSocket } = await import('../../static/js/socket.js')
  globalThis.addEventListener ??= () => {}
  globalThis.removeEventListener ??= () => {}
  const made = []
  class Socket {
    constructor() {
      made.push(this)
      this.readyState = 0
      // The first is opened and lost, the second refused, the third opened again.
      setTimeout(() => (made.length === 2 ? this.onclose() : ((this.readyState = 1), this.onopen())))
    }
    send() {}
    close() {}
  }
  const heard = []
  const line = new LiveSocket('ws://x', { onOpen: () => heard.push('open'), onClosed: () => heard.push('closed'), onMessage: (message) => heard.push(message.type) },
    { Socket, backoff: new Backoff(0.01, 0.01) })
  const passing = (ms) => new Promise((resolve) => setTimeout(resolve, ms))
  await passing(10)
  made[0].onmessage({ data: '{"type":"status"}' })
  made[0].onclose()
  await passing(80)
  assert.equal(line.isOpen, true)
  line.close()
  assert.deepEqual(heard, ['open', 'status', 'closed', 'open'])
})
