// block.js — the person drives the arm in a study, under a way of steering that has a number and no name.
import { Backoff } from '../backoff.js'
import { DriverSeat } from '../driver_seat.js'
import { html } from '../element.js'
import { newId } from '../ids.js'

// The server keeps an attempt's end a moment after it told of it.
const ASK_S = 0.4
const ASK_LIMIT_S = 3

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountBlock(root, context) {
  const step = new BlockStep(root, context)
  return () => step.close()
}

class BlockStep {
  constructor(root, context) {
    const { visit } = context
    this.visit = visit
    this.live = context.live
    this.turn = context.turn
    const { key, task, block } = visit.session
    this.body = { id: newId(), key }
    this.stop = new AbortController()
    this.timer = 0
    this.ended = ''
    this.seat = new DriverSeat(context, {
      onAgain: () => {
        void this.seat.link.open(null)
        this.seat.inputs.pad.focus()
      },
      onFollow: (status) => this.#follow(status),
      isBusy: () => this.visit.session.block?.may_continue ?? true,
    })
    const { seat } = this
    seat.link.strategy = null
    seat.link.wanted = block.open_drive
    this.next = html('button', { class: 'button primary', type: 'button', 'data-testid': 'continue', hidden: true, onclick: () => this.#goOn() }, 'Continue')
    this.made = html('p', { class: 'quiet small', 'data-testid': 'drives-made' })
    this.element = html('div', { class: 'driving block' },
      html('h1', { tabindex: -1, 'data-testid': 'way-of-steering' }, `${task}: way of steering ${block.position} of ${block.of}`),
      block.position > 1 && html('p', { class: 'note small', 'data-testid': 'another-way' }, 'The arm answers the stick in another way now.'),
      seat.attempt.element, this.made, seat.inputs.pad.element, seat.hold,
      // In the place of giving up, so that nothing moves when the attempt is over.
      html('div', { class: 'driving-end' }, this.next, seat.attempt.giveUp, seat.stick.button))
    root.append(this.element, seat.stick.element)
    this.unwatch = visit.watch((session) => this.#draw(session))
    this.#draw(visit.session)
    seat.follow()
    // What the arm did last was another block's: begin, or take up again what a reload broke off.
    if (!block.may_continue) void seat.link.open(null)
  }

  close() {
    clearTimeout(this.timer)
    this.stop.abort()
    this.unwatch()
    this.seat.close()
  }

  #draw({ key, block }) {
    if (key !== this.body.key || block === null) return
    const { attempt, link, stick } = this.seat
    const isNew = this.next.hidden && block.may_continue
    this.next.hidden = !block.may_continue
    this.made.hidden = block.drives_wanted === 1
    this.made.textContent = `${block.drives_made} of ${block.drives_wanted} tries made`
    attempt.mayTryAgain = !block.may_continue
    if (block.may_continue) attempt.again.hidden = true
    attempt.again.textContent = block.drives_made > 0 ? 'Next try' : 'Try again'
    link.isDone = block.may_continue
    if (!isNew) return
    this.turn()
    this.seat.follow()
    this.next.scrollIntoView({ block: 'nearest' })
    // Who uses the keyboard goes on from here; who is pressing something else is left alone.
    const { activeElement } = document
    const isFree = activeElement === document.body || activeElement?.matches('.pad, h1, [hidden]')
    if (isFree && !stick.isOpen) this.next.focus()
  }

  /** An attempt is over: the server says whether that was the last one. */
  #follow(status) {
    const end = status?.progress?.end ?? null
    if (end === null || status.drive_id === this.ended) return
    this.ended = status.drive_id
    this.#ask(this.visit.session.block?.drives_made ?? 0, new Backoff(ASK_S, ASK_LIMIT_S))
  }

  /** Ask until the attempt is counted, or the next one has begun. */
  #ask(made, backoff) {
    clearTimeout(this.timer)
    this.timer = setTimeout(async () => {
      await this.visit.refresh()
      const { block, key } = this.visit.session
      const isOver = this.live.status === null || (this.live.status.progress?.end ?? null) !== null
      const isCounted = key !== this.body.key || block === null || block.drives_made > made || block.may_continue
      if (!this.stop.signal.aborted && isOver && !isCounted) this.#ask(made, backoff)
    }, backoff.step())
  }

  async #goOn() {
    if (this.next.disabled) return
    this.next.disabled = true
    try {
      this.visit.adopt(await this.visit.api.postSurely('block', this.body, { signal: this.stop.signal, onTrouble: () => (this.seat.hold.textContent = 'Not saved yet, trying again…') }))
    } catch (error) {
      if (this.stop.signal.aborted) return
      this.next.disabled = false
      this.visit.explain(error)
    }
  }
}
