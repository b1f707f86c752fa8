// driving.js — the person drives the arm, under one strategy or another.
import { AttemptPanel } from '../attempt_panel.js'
import { DriveLink } from '../drive_link.js'
import { ICONS, html, icon } from '../element.js'
import { LearnedDialog } from '../learned_dialog.js'
import { StickDialog } from '../stick_dialog.js'
import { StickInputs, eachFrame } from '../stick_inputs.js'
import { StrategyChoice } from '../strategy_choice.js'

const HOLDS = {
  released: 'Released: the arm holds',
  silent: 'No signal: the arm holds',
  edge: 'At the edge of where it can go',
  'moving-home': 'Going back to the start',
  'by-itself': 'The arm moves by itself',
  over: 'The arm holds',
}
const READOUT_MS = 250

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountDriving(root, context) {
  const step = new DrivingStep(root, context)
  return () => step.close()
}

class DrivingStep {
  constructor(root, { visit, live, scene, banners }) {
    this.visit = visit
    this.live = live
    this.banners = banners
    const { strategies } = visit.session
    this.strategy = strategies[0].name
    this.last = null
    this.readAt_ms = 0
    this.hasArrows = false
    const shortcuts = Object.fromEntries(strategies.map(({ name }, index) => [`Digit${index + 1}`, () => this.choose(name)]))
    this.inputs = new StickInputs({
      visit,
      label: 'Joystick',
      hint: 'Hold the arrow keys or W, A, S, D to move the arm; let go and it holds. Two keys make a diagonal; Shift is gentle.',
      shortcuts: { ...shortcuts, KeyH: () => this.home(), Space: () => this.grasp() },
      buttons: { 0: () => this.grasp() },
    })
    this.attempt = new AttemptPanel({ onGrasp: () => this.grasp(), onGiveUp: () => this.live.send({ type: 'give-up' }), onAgain: () => this.choose(this.strategy) })
    this.choice = new StrategyChoice(strategies, (name) => this.choose(name))
    const onDialog = (isOpen) => {
      this.follow()
      if (!isOpen) this.inputs.pad.focus()
    }
    this.learned = new LearnedDialog(visit, onDialog)
    this.stick = new StickDialog(visit, onDialog)
    this.link = new DriveLink(visit, live, () => this.inputs.read(performance.now()))
    this.arrows = html('input', { type: 'checkbox', 'data-testid': 'arrows', onchange: () => this.point() })
    this.#build(root, scene)
    this.listening = new AbortController()
    live.addEventListener('status', () => this.follow(), { signal: this.listening.signal })
    live.addEventListener('closed', () => this.follow(), { signal: this.listening.signal })
    this.stopDrawing = eachFrame((now_ms, dt_s) => this.inputs.pad.draw(this.inputs.readSteady(now_ms, dt_s)))
    this.link.strategy = this.strategy
    this.choice.draw(this.strategy)
    this.follow()
  }

  choose(name) {
    this.#begin(name)
    this.inputs.pad.focus()
  }

  #begin(name) {
    this.strategy = name
    this.choice.draw(name)
    if (this.live.isOpen) void this.link.open(name)
    else this.link.strategy = name
  }

  grasp() {
    if (this.live.status?.progress) this.live.send({ type: 'press' })
    this.inputs.pad.focus()
  }

  home() {
    this.live.send({ type: 'home' })
    this.inputs.pad.focus()
  }

  /** What the arm does, in words. */
  follow() {
    const { status } = this.live
    const isElsewhere = status !== null && !status.has_stick
    if (isElsewhere) {
      this.banners.show('stick', 'You are steering in another tab.', { button: 'Steer here', testid: 'take-stick', onPress: () => this.take() })
    } else if (status !== null) {
      this.banners.clear('stick')
    }
    const isOn = !isElsewhere && !this.learned.isOpen && !this.stick.isOpen
    if (this.inputs.isOn !== isOn) this.inputs.enabled = isOn
    if (status?.strategy && !this.link.isOpening && status.strategy !== this.strategy) {
      this.strategy = status.strategy
      this.link.strategy = status.strategy
      this.choice.draw(status.strategy)
    }
    const words = this.#words(status)
    if (this.hold.textContent !== words) this.hold.textContent = words
    this.hold.dataset.hold = status === null ? 'offline' : (status.hold ?? 'moving')
    this.hold.dataset.drive = status?.drive_id ?? ''
    const progress = status?.progress ?? null
    this.attempt.draw(progress)
    this.homeButton.hidden = progress !== null
    if (status) {
      // What was said before the box was ticked must not untick it.
      if (status.arrows !== this.hasArrows) this.arrows.checked = status.arrows
      this.hasArrows = status.arrows
      this.inputs.pad.ways = status.arrows
      this.#read(status)
    }
  }

  /** Show or hide where each direction of the stick leads. */
  point() {
    this.live.send({ type: 'arrows', shown: this.arrows.checked })
    this.inputs.pad.focus()
  }

  take() {
    this.live.send({ type: 'take' })
    this.inputs.pad.focus()
  }

  close() {
    this.listening.abort()
    this.stopDrawing()
    this.link.close()
    this.inputs.close()
    this.learned.close()
    this.stick.close()
    this.banners.clear('stick')
  }

  #words(status) {
    if (status === null) return 'Not connected: the arm holds'
    if (!status.has_stick) return 'Steered from another tab'
    if (status.mode !== 'driving') return 'Getting the arm ready…'
    return status.hold === null ? 'Moving' : HOLDS[status.hold]
  }

  #read({ hand }) {
    const now_ms = performance.now()
    const dt_s = (now_ms - this.readAt_ms) / 1000
    if (dt_s * 1000 < READOUT_MS) return
    const speed = this.last === null ? 0 : (100 * Math.hypot(...hand.map((value, axis) => value - this.last[axis]))) / dt_s
    this.last = hand
    this.readAt_ms = now_ms
    const [forward, left] = hand.map((value) => Math.round(100 * value))
    const side = left === 0 ? 'in the middle' : `${Math.abs(left)} cm ${left > 0 ? 'left' : 'right'}`
    this.readout.textContent = `${speed < 10 ? speed.toFixed(1) : Math.round(speed)} cm/s · hand ${forward} cm forward, ${side}`
  }

  #build(root, scene) {
    this.hold = html('p', { class: 'hold', role: 'status', 'data-testid': 'hold' })
    this.readout = html('p', { class: 'readout', 'data-testid': 'readout', 'aria-hidden': 'true' })
    scene.tools.append(this.readout,
      html('label', { class: 'switch', hidden: !this.visit.session.may_switch_arrows }, this.arrows, html('span', {}, 'Arrows', html('span', { class: 'switch-more' }, ': where the stick leads'))))
    this.homeButton = html('button', { class: 'button', type: 'button', 'data-testid': 'home', 'aria-keyshortcuts': 'H', onclick: () => this.home() },
      icon(ICONS.home), 'Back to the start', html('kbd', { 'aria-hidden': 'true' }, 'H'))
    const learned = html('button', { class: 'button plain-text', type: 'button', 'data-testid': 'see-learned', onclick: () => this.learned.open() }, 'See what it learned')
    root.append(html('div', { class: 'driving' },
      html('h1', { tabindex: -1 }, 'Drive the arm'),
      this.choice.element, this.attempt.element, this.inputs.pad.element, this.hold,
      html('div', { class: 'driving-end' }, this.homeButton, this.attempt.giveUp, learned, this.stick.button)),
    this.learned.element, this.stick.element)
  }
}
