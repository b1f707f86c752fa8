// driving.js — the person drives the arm freely, under one strategy or another.
import { DriverSeat } from '../driver_seat.js'
import { ICONS, html, icon } from '../element.js'
import { LearnedDialog } from '../learned_dialog.js'
import { StrategyChoice } from '../strategy_choice.js'

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountDriving(root, context) {
  const step = new DrivingStep(root, context)
  return () => step.close()
}

class DrivingStep {
  constructor(root, context) {
    const { visit, live } = context
    this.live = live
    const { strategies } = visit.session
    this.strategy = strategies[0].name
    const choices = Object.fromEntries(strategies.map(({ name }, index) => [`Digit${index + 1}`, () => this.choose(name)]))
    this.seat = new DriverSeat(context, {
      shortcuts: { ...choices, KeyH: () => this.home() },
      onAgain: () => this.choose(this.strategy),
      onFollow: (status) => this.#follow(status),
      isBusy: () => this.learned?.isOpen ?? false,
    })
    this.choice = new StrategyChoice(strategies, (name) => this.choose(name))
    this.learned = new LearnedDialog(visit, (isOpen) => this.seat.onDialog(isOpen))
    this.#build(root)
    this.seat.link.strategy = this.strategy
    this.choice.draw(this.strategy)
    this.seat.follow()
  }

  choose(name) {
    this.strategy = name
    this.choice.draw(name)
    if (this.live.isOpen) void this.seat.link.open(name)
    else this.seat.link.strategy = name
    this.seat.inputs.pad.focus()
  }

  home() {
    this.live.send({ type: 'home' })
    this.seat.inputs.pad.focus()
  }

  close() {
    this.seat.close()
    this.learned.close()
  }

  #follow(status) {
    if (status?.strategy && !this.seat.link.isOpening && status.strategy !== this.strategy) {
      this.strategy = status.strategy
      this.seat.link.strategy = status.strategy
      this.choice.draw(status.strategy)
    }
    if (this.homeButton) this.homeButton.hidden = (status?.progress ?? null) !== null
  }

  #build(root) {
    const { seat } = this
    this.homeButton = html('button', { class: 'button', type: 'button', 'data-testid': 'home', 'aria-keyshortcuts': 'H', onclick: () => this.home() },
      icon(ICONS.home), 'Back to the start', html('kbd', { 'aria-hidden': 'true' }, 'H'))
    const learned = html('button', { class: 'button plain-text', type: 'button', 'data-testid': 'see-learned', onclick: () => this.learned.open() }, 'See what it learned')
    root.append(html('div', { class: 'driving' },
      html('h1', { tabindex: -1 }, 'Drive the arm'),
      this.choice.element, seat.attempt.element, seat.inputs.pad.element, seat.hold,
      html('div', { class: 'driving-end' }, this.homeButton, seat.attempt.giveUp, learned, seat.stick.button)),
    this.learned.element, seat.stick.element)
  }
}
