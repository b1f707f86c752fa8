// queries.js — moves of the arm: "what would you do with the stick for this one?"
import { AnswerMark } from '../answer_mark.js'
import { AnswerSaver } from '../answer_saver.js'
import { html } from '../element.js'
import { newId } from '../ids.js'
import { MovePlayer } from '../move_player.js'
import { QuestionDots } from '../question_dots.js'
import { StickInputs, eachFrame } from '../stick_inputs.js'

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountQueries(root, context) {
  const step = new QueriesStep(root, context)
  return () => step.close()
}

class QueriesStep {
  constructor(root, { visit, live, scene, announce, turn }) {
    this.visit = visit
    this.announce = announce
    this.turn = turn
    this.saver = new AnswerSaver(visit.api)
    this.stop = new AbortController()
    this.mark = new AnswerMark()
    this.index = -1
    this.began_ms = 0
    this.isBusy = false
    this.player = new MovePlayer(live, scene, () => this.again())
    this.dots = new QuestionDots((index) => {
      this.choose(index)
      this.inputs.pad.focus()
    })
    this.inputs = new StickInputs({
      visit,
      label: 'Joystick: your answer',
      hint: 'Hold the arrow keys or W, A, S, D to move your answer; it stays where you leave it. Shift moves it slowly.',
      says: 'Your answer:',
      onTap: (direction) => this.mark.tap(direction),
      onPointer: (h) => {
        this.mark.point(h)
        this.offer()
      },
      onPoll: (now_ms, dt_s) => this.poll(now_ms, dt_s),
      shortcuts: { Enter: () => this.confirm(), NumpadEnter: () => this.confirm(), KeyR: () => this.again() },
      buttons: { 0: () => this.pressA(), 3: () => this.again() },
    })
    this.#build(root)
    this.unwatch = visit.watch(() => this.follow())
    this.stopDrawing = eachFrame(() => this.draw())
    this.choose(this.#next())
    if (this.saver.unsaved) void this.#save(this.saver.unsaved)
  }

  get queries() {
    return this.visit.session.queries
  }

  get query() {
    return this.queries[this.index]
  }

  close() {
    this.stop.abort()
    this.unwatch()
    this.stopDrawing()
    this.inputs.close()
    this.player.close()
  }

  choose(index) {
    if (this.isBusy || index === this.index) return
    this.index = index
    this.turn()
    const h = this.query.answer?.h ?? null
    this.mark.set(h && { x: h[0], y: h[1] })
    this.inputs.letGo()
    this.began_ms = performance.now()
    this.state.textContent = ''
    this.player.play(this.query.id)
    this.follow()
    this.announce(this.heading.textContent)
  }

  /** The session changed: say where we are, keep what is marked. */
  follow() {
    const { queries } = this
    this.heading.textContent = `Question ${this.index + 1} of ${this.visit.session.may_end_early ? 'at most ' : ''}${queries.length}`
    this.dots.draw(queries, this.index)
    const open = queries.filter((query) => query.answer === null)
    const isLast = open.length === 1 && open[0] === this.query
    const notice = this.visit.session.notice ?? (isLast ? 'Last question: confirming starts the learning. Earlier answers can still be changed first.' : '')
    this.notice.textContent = notice
    this.notice.hidden = notice === ''
    this.hint.hidden = notice !== ''
    this.cantSay.disabled = this.isBusy || this.query.answer?.h === null
  }

  /** Keys and gamepads move the mark, however few pictures are drawn. */
  poll(now_ms, dt_s) {
    if (this.inputs.isOn) this.mark.follow(this.inputs.state, dt_s, now_ms)
    this.offer()
  }

  draw() {
    const { h } = this.mark
    this.inputs.pad.draw(h, h === null ? 'empty' : this.#isKept(h) ? 'saved' : 'marked')
  }

  /** What can be confirmed now. */
  offer() {
    const { h } = this.mark
    const isKept = this.#isKept(h)
    this.confirmButton.disabled = this.isBusy || h === null
    const words = this.isBusy ? 'Saving…' : isKept ? 'Keep this answer' : this.query.answer?.h ? 'Change the answer' : 'Confirm answer'
    if (this.confirmWords.textContent !== words) this.confirmWords.textContent = words
  }

  again() {
    this.player.play(this.query.id)
    this.inputs.pad.focus()
  }

  pressA() {
    if (this.inputs.state.pad.x !== 0 || this.inputs.state.pad.y !== 0) this.mark.press(this.inputs.state.pad)
    else this.confirm()
  }

  confirm() {
    const { h } = this.mark
    if (this.isBusy) return
    if (h === null) {
      this.state.textContent = 'First mark on the stick what you would do.'
    } else if (this.#isKept(h)) {
      this.choose(this.#next())
    } else {
      void this.#save(this.#answer([round(h.x), round(h.y)]))
    }
  }

  #answer(h) {
    return { id: newId(), query_id: this.query.id, h, thinking_time_s: round((performance.now() - this.began_ms) / 1000) }
  }

  #isKept(h) {
    const kept = this.query.answer?.h
    return h !== null && kept !== null && kept !== undefined && Math.hypot(kept[0] - h.x, kept[1] - h.y) < 1e-3
  }

  /** @returns {number} the first question without an answer; the last one if all have one. */
  #next() {
    const open = this.queries.findIndex((query) => query.answer === null)
    return open === -1 ? this.queries.length - 1 : open
  }

  async #save(body) {
    const before = this.queries.length
    this.#setBusy(true, 'Saving…')
    try {
      const session = await this.saver.save(body, {
        signal: this.stop.signal,
        onTrouble: () => (this.state.textContent = 'Not saved yet, trying again…'),
      })
      this.#setBusy(false, '')
      this.visit.adopt(session)
      if (this.stop.signal.aborted) return
      const isMore = session.queries.length > before
      this.follow()
      this.choose(this.#next())
      this.inputs.pad.focus()
      this.state.textContent = isMore ? 'That’s fine. One more move was added instead.' : 'Saved.'
    } catch (error) {
      if (this.stop.signal.aborted) return
      this.#setBusy(false, '')
      this.visit.explain(error)
    }
  }

  #setBusy(isBusy, sentence) {
    this.isBusy = isBusy
    this.inputs.enabled = !isBusy
    this.state.textContent = sentence
    this.cantSay.disabled = isBusy
    this.element.setAttribute('aria-busy', String(isBusy))
  }

  #build(root) {
    this.heading = html('h1', { tabindex: -1, 'data-testid': 'question' })
    this.hint = html('p', { class: 'quiet small hint' }, 'Drag the stick and let go; your answer stays. The further you push, the faster the arm moves.')
    this.notice = html('p', { class: 'note small', role: 'status' })
    this.state = html('p', { class: 'quiet small save-state', role: 'status', 'data-testid': 'save-state' })
    this.confirmWords = html('span', {}, 'Confirm answer')
    this.confirmButton = html('button', { class: 'button primary', type: 'button', 'data-testid': 'confirm', onclick: () => this.confirm() }, this.confirmWords)
    this.cantSay = html('button', { class: 'button', type: 'button', 'data-testid': 'cant-say', onclick: () => void this.#save(this.#answer(null)) }, 'I can’t say')
    this.element = html('div', { class: 'queries' },
      html('div', { class: 'queries-head' }, this.heading, this.dots.element),
      html('p', { class: 'queries-ask' }, 'If you wanted the arm to make this move, what would you do with the stick?'),
      this.inputs.pad.element,
      this.hint,
      this.notice,
      html('div', { class: 'queries-end' }, this.confirmButton, this.cantSay),
      this.state)
    root.append(this.element)
  }
}

function round(value) {
  return Math.round(value * 1e4) / 1e4
}
