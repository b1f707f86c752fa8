// block.js — the person drives the arm in a study, under a way of steering that has a number and no name.
import { DriverSeat } from '../driver_seat.js'
import { html } from '../element.js'
import { newId } from '../ids.js'

const ASK_MS = 400

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountBlock(root, context) {
  const step = new BlockStep(root, context)
  return () => step.close()
}

class BlockStep {
  constructor(root, context) {
    const { visit } = context
    this.visit = visit
    const { key, task, block } = visit.session
    this.body = { id: newId(), key }
    this.stop = new AbortController()
    this.ended = ''
    this.seat = new DriverSeat(context, {
      onAgain: () => void this.seat.link.open(null),
      onFollow: (status) => this.#follow(status),
    })
    this.seat.link.strategy = null
    this.seat.link.wanted = block.open_drive
    this.next = html('button', { class: 'button primary large', type: 'button', 'data-testid': 'continue', hidden: true, onclick: () => this.#goOn() }, 'Continue')
    this.made = html('p', { class: 'quiet small', 'data-testid': 'drives-made' })
    root.append(html('div', { class: 'driving' },
      html('h1', { tabindex: -1 }, task),
      html('p', { class: 'block-way', 'data-testid': 'way-of-steering' },
        html('b', {}, `Way of steering ${block.position} of ${block.of}`),
        block.position === 1 ? '' : '. The arm answers the stick in another way now.'),
      this.seat.attempt.element, this.made, this.next, this.seat.inputs.pad.element, this.seat.hold,
      html('div', { class: 'driving-end' }, this.seat.attempt.giveUp, this.seat.stick.button)),
    this.seat.stick.element)
    this.unwatch = visit.watch((session) => this.#draw(session))
    this.#draw(visit.session)
    this.seat.follow()
    // What the arm did last was another block's: begin, or take up again what a reload broke off.
    if (!block.may_continue) void this.seat.link.open(null)
  }

  close() {
    this.stop.abort()
    this.unwatch()
    this.seat.close()
  }

  #draw({ step, block }) {
    if (step !== 'block' || block === null) return
    this.next.hidden = !block.may_continue
    this.made.hidden = block.drives_wanted === 1
    this.made.textContent = `${block.drives_made} of ${block.drives_wanted} tries made`
    this.seat.attempt.again.classList.toggle('unseen', block.may_continue)
    if (block.may_continue && !this.seat.stick.isOpen && document.activeElement === this.seat.inputs.pad.element) this.next.focus()
  }

  /** An attempt is over: the server says whether that was the last one. */
  #follow(status) {
    const end = status?.progress?.end ?? null
    if (end === null || status.drive_id === this.ended) return
    this.ended = status.drive_id
    setTimeout(() => this.stop.signal.aborted || void this.visit.refresh(), ASK_MS)
  }

  async #goOn() {
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
