// What a study's pages keep, and what they must not know.
import assert from 'node:assert/strict'
import { readFileSync } from 'node:fs'
import { dirname, join, resolve } from 'node:path'
import test from 'node:test'
import { Draft, forgetDrafts, optionsOf } from '../../static/js/draft.js'
import { isLeftOver } from '../../static/js/one_press.js'
import { Visit } from '../../static/js/visit.js'

const STATIC = resolve(import.meta.dirname, '../../static')

class Store extends Map {
  getItem = (place) => this.get(place) ?? null
  setItem = (place, content) => this.set(place, content)
  removeItem = (place) => this.delete(place)
  key = (index) => [...this.keys()][index] ?? null
  get length() {
    return this.size
  }
}

const scale = { key: 'easy', kind: 'scale', text: 'It was easy.', low: 1, high: 7, step: 1, low_label: 'no', high_label: 'yes', choices: [] }
const words = { ...scale, key: 'why', kind: 'text' }
const clock = (...hours) => () => new Date(`2026-01-01T0${hours.shift()}:00:00Z`)

test('a scale offers every mark from its low to its high end, and only the ends have words', () => {
  const marks = optionsOf({ ...scale, low: 0, high: 100, step: 5 }, 3)
  assert.equal(marks.length, 21)
  assert.deepEqual(marks.map(({ value }) => value).slice(0, 3), [0, 5, 10])
  assert.deepEqual(marks.filter(({ end }) => end), [{ value: 0, title: '0', end: 'no' }, { value: 100, title: '100', end: 'yes' }])
})
test('a scale whose step does not meet its high end stops before it', () => {
  assert.deepEqual(optionsOf({ ...scale, low: 0, high: 10, step: 4 }, 3).map(({ value }) => value), [0, 4, 8])
})
test('ways of steering are counted, not named', () => {
  assert.deepEqual(optionsOf({ ...scale, kind: 'strategy' }, 3).map(({ title }) => title), ['First way', 'Second way', 'Third way'])
  assert.deepEqual(optionsOf({ ...scale, kind: 'strategy' }, 3).map(({ value }) => value), [1, 2, 3])
})
test('choices are answered with their words, and words with words', () => {
  assert.deepEqual(optionsOf({ ...scale, kind: 'choice', choices: ['Left', 'Right'] }, 3).map(({ value }) => value), ['Left', 'Right'])
  assert.equal(optionsOf(words, 3), null)
})
test('a draft outlives the page, with its id and with when each answer was given', () => {
  const store = new Store()
  const draft = new Draft([scale, words], 'questions/a', '/p/T/api', store, clock(1, 2))
  draft.give(scale, 4)
  draft.give(words, null)
  const again = new Draft([scale, words], 'questions/a', '/p/T/api', store)
  assert.deepEqual(again.body, {
    id: draft.id, key: 'questions/a',
    responses: [{ item: 'easy', value: 4, answered_at: '2026-01-01T01:00:00.000Z' }, { item: 'why', value: null, answered_at: '2026-01-01T02:00:00.000Z' }],
  })
})
test('the id is kept before anything is answered', () => {
  const store = new Store()
  assert.equal(new Draft([scale], 'a', 'b', store).id, new Draft([scale], 'a', 'b', store).id)
})
test('an answer that is changed carries the later time, and one taken back is open again', () => {
  const draft = new Draft([scale, words], 'a', 'b', new Store(), clock(1, 2))
  draft.give(scale, 4)
  draft.give(scale, 5)
  assert.equal(draft.given.easy.answered_at, '2026-01-01T02:00:00.000Z')
  draft.take(scale)
  assert.deepEqual(draft.open, [scale, words])
  assert.equal(draft.valueOf(scale), undefined)
})
test('declining is an answer', () => {
  const draft = new Draft([scale], 'a', 'b', new Store())
  draft.give(scale, null)
  assert.deepEqual(draft.open, [])
  assert.equal(draft.valueOf(scale), null)
})
test('each questionnaire and each person has a draft of their own', () => {
  const store = new Store()
  new Draft([scale], 'questions/a', '/p/T/api', store).give(scale, 4)
  for (const [key, base] of [['questions/b', '/p/T/api'], ['questions/a', '/p/U/api']]) {
    assert.deepEqual(new Draft([scale], key, base, store).open, [scale])
  }
})
test('what is kept and makes no sense is left aside', () => {
  for (const kept of ['', '{', '7', '{"id":1,"given":{"easy":3}}', '{"given":null}']) {
    const store = new Store([['joymap questions b a', kept]])
    assert.deepEqual(new Draft([scale], 'a', 'b', store).open, [scale], kept)
  }
})
test('a storage that refuses costs only the survival of a reload', () => {
  const refuse = () => { throw new Error('full') }
  const draft = new Draft([scale], 'a', 'b', { getItem: refuse, setItem: refuse, removeItem: refuse })
  draft.give(scale, 2)
  assert.equal(draft.body.responses[0].value, 2)
  draft.forget()
})
test('who leaves takes their drafts along, and nobody else’s', () => {
  const store = new Store([['something else', '1']])
  for (const key of ['a', 'b']) new Draft([scale], key, '/p/T/api', store).give(scale, 4)
  new Draft([scale], 'a', '/p/TT/api', store)
  forgetDrafts('/p/T/api', store)
  assert.deepEqual([...store.keys()], ['something else', 'joymap questions /p/TT/api a'])
})
test('only the rest of a double click that began on another page is left over', () => {
  assert.ok(isLeftOver({ detail: 2, timeStamp: 1200 }, 1000))
  assert.ok(!isLeftOver({ detail: 1, timeStamp: 1200 }, 1000))
  assert.ok(!isLeftOver({ detail: 2, timeStamp: 2000 }, 1000))
  assert.ok(!isLeftOver({ detail: 0, timeStamp: 1001 }, 1000)) // from a key
})

function scriptsOf(page) {
  const waiting = [...readFileSync(join(STATIC, page), 'utf8').matchAll(/(?:src|href)="(?:\.\.\/)+static\/([^"]+)"/g)].map(([, path]) => join(STATIC, path))
  const found = new Set()
  while (waiting.length > 0) {
    const path = waiting.pop()
    if (found.has(path)) continue
    found.add(path)
    if (!path.endsWith('.js')) continue
    const imports = readFileSync(path, 'utf8').matchAll(/^(?:import|export) .*?from '(\.[^']+)'|^import '(\.[^']+)'/gm)
    for (const [, from, bare] of imports) waiting.push(resolve(dirname(path), from ?? bare))
  }
  return [...found, join(STATIC, page)]
}

test('no file that every participant’s page loads names a way of steering', () => {
  const names = /no-align|no-priors|all-priors|task-space|proportionality|reversibility|consistency|your mapping|answers only|robot’s own/i
  for (const page of ['participant.html', 'join.html']) {
    const files = scriptsOf(page)
    assert.ok(files.length > 5, page)
    for (const file of files) assert.doesNotMatch(readFileSync(file, 'utf8'), names, file)
  }
  assert.ok(scriptsOf('participant.html').some((file) => file.endsWith('steps/block.js')))
  assert.ok(!scriptsOf('participant.html').some((file) => file.endsWith('learned.js')))
})
test('a step that another watcher has taken down hears nothing of what comes next', () => {
  const visit = new Visit({}, {})
  const heard = []
  let stop = () => {}
  visit.watch(() => stop())
  stop = visit.watch(() => heard.push('the step that is left'))
  visit.watch(() => heard.push('the rest'))
  visit.adopt({})
  assert.deepEqual(heard, ['the rest'])
})
