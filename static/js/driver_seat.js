// driver_seat.js — what everyone who drives has: stick, task, what the arm does, and arrows.
import { AttemptPanel } from './attempt_panel.js'
import { DriveLink } from './drive_link.js'
import { html } from './element.js'
import { StickDialog } from './stick_dialog.js'
import { StickInputs, eachFrame } from './stick_inputs.js'

const HOLDS = {
  released: 'Released: the arm holds',
  silent: 'No signal: the arm holds',
  edge: 'At the edge of where it can go',
  'moving-home': 'Going back to the start',
  'by-itself': 'The arm moves by itself',
  over: 'The arm holds',
}
const READOUT_MS = 250

export class DriverSeat {
  /**
   * @param {import('./participant.js').Context} context
   * @param {{shortcuts?: Record<string, () => void>, onAgain: () => void, onFollow: (status: any) => void, isBusy?: () => boolean}} options
   */
  constructor({ visit, live, scene, banners }, { shortcuts = {}, onAgain, onFollow, isBusy = () => false }) {
    this.visit = visit
    this.live = live
    this.banners = banners
    this.onFollow = onFollow
    this.isBusy = isBusy
    this.last = null
    this.readAt_ms = 0
    this.hasArrows = false
    this.inputs = new StickInputs({
      visit,
      label: 'Joystick',
      hint: 'Hold the arrow keys or W, A, S, D to move the arm; let go and it holds. Two keys make a diagonal; Shift is gentle.',
      shortcuts: { ...shortcuts, Space: () => this.grasp() },
      buttons: { 0: () => this.grasp() },
    })
    this.attempt = new AttemptPanel({ onGrasp: () => this.grasp(), onGiveUp: () => live.send({ type: 'give-up' }), onAgain })
    this.stick = new StickDialog(visit, (isOpen) => this.onDialog(isOpen))
    this.link = new DriveLink(visit, live, this.inputs)
    this.arrows = html('input', { type: 'checkbox', 'data-testid': 'arrows', onchange: () => this.point() })
    this.hold = html('p', { class: 'hold', role: 'status', 'data-testid': 'hold' })
    this.readout = html('p', { class: 'readout', 'data-testid': 'readout', 'aria-hidden': 'true' })
    scene.tools.append(this.readout,
      html('label', { class: 'switch', hidden: !visit.session.may_switch_arrows }, this.arrows, html('span', {}, 'Arrows', html('span', { class: 'switch-more' }, ': where the stick leads'))))
    this.listening = new AbortController()
    live.addEventListener('status', () => this.follow(), { signal: this.listening.signal })
    live.addEventListener('closed', () => this.follow(), { signal: this.listening.signal })
    this.stopDrawing = eachFrame((now_ms, dt_s) => this.inputs.pad.draw(this.inputs.readSteady(now_ms, dt_s)))
  }

  grasp() {
    if (this.live.status?.progress) this.live.send({ type: 'press' })
    this.inputs.pad.focus()
  }

  onDialog(isOpen) {
    this.follow()
    if (!isOpen) this.inputs.pad.focus()
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
    const isOn = !isElsewhere && !this.stick.isOpen && !this.isBusy()
    if (this.inputs.isOn !== isOn) this.inputs.enabled = isOn
    const words = this.#words(status)
    if (this.hold.textContent !== words) this.hold.textContent = words
    this.hold.dataset.hold = status === null ? 'offline' : (status.hold ?? 'moving')
    this.hold.dataset.drive = status?.drive_id ?? ''
    this.attempt.draw(status?.progress ?? null)
    if (status) {
      // What was said before the box was ticked must not untick it.
      if (status.arrows !== this.hasArrows) this.arrows.checked = status.arrows
      this.hasArrows = status.arrows
      this.inputs.pad.ways = status.arrows
      this.#read(status)
    }
    this.onFollow(status)
  }

  /** Show or hide where each direction of the stick leads. */
  point() {
    // Without a line the box must not say what is not so.
    if (!this.live.send({ type: 'arrows', shown: this.arrows.checked })) this.arrows.checked = this.hasArrows
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
}
