// learned.js — what was learned: both fields at three moments of the training, and the curves.
import { LossChart } from './chart.js'
import { ICONS, html, icon } from './element.js'
import { FieldPlot, fieldLegend } from './field.js'
import { arrowScale } from './field_geometry.js'

/** @typedef {{curve: [number, number][], fields: import('./field_geometry.js').Snapshot[]}} Learned */

const MOMENTS = Object.freeze([{ fraction: 0, title: 'Start' }, { fraction: 0.5, title: 'Half-way' }, { fraction: 1, title: 'End' }])
const DWELL_MS = 1300

export class LearnedPanel {
  /** @param {import('./api.js').Session} session */
  constructor({ strategies, field_says: fieldSays }) {
    this.strategies = strategies.filter(({ has_curve }) => has_curve)
    this.plots = new Map(this.strategies.map(({ name, title, note }) => [name, new FieldPlot(title, note)]))
    this.chart = new LossChart()
    this.moment = -1
    this.timer = 0
    /** @type {Record<string, Learned>} */
    this.learned = {}
    this.buttons = MOMENTS.map(({ title }, index) =>
      html('button', { class: 'segment', type: 'button', 'aria-pressed': 'false', onclick: () => { this.pause(); this.show(index) } }, title))
    this.playButton = html('button', { class: 'button', type: 'button', onclick: () => this.play() }, icon(ICONS.play), 'Play')
    this.element = html('div', { class: 'learned' },
      html('div', { class: 'learned-controls' },
        html('p', { class: 'small' }, fieldSays),
        fieldLegend(),
        html('div', { class: 'replay' },
          html('div', { class: 'segments', role: 'group', 'aria-label': 'Moment of the learning' }, this.buttons), this.playButton)),
      html('div', { class: 'fields' }, [...this.plots.values()].map((plot) => plot.element)),
      this.chart.element)
    this.#offer()
  }

  /** @param {Record<string, Learned>} learned what there is so far */
  update(learned) {
    this.learned = learned
    const all = this.#snapshots()
    this.scale = all.length > 0 ? arrowScale(all) : 1
    this.chart.draw(this.strategies.map(({ name, title }) => ({ title, curve: learned[name]?.curve ?? [] })))
    const latest = MOMENTS.findLastIndex((_, index) => this.#has(index))
    this.#offer()
    for (const [name, plot] of this.plots) if (!learned[name]?.fields.length) plot.clear()
    this.chart.element.hidden = !Object.values(learned).some(({ curve }) => curve.length > 0)
    if (latest !== -1) this.show(latest)
  }

  /** From the start to the end, resting at each moment. */
  play() {
    this.pause()
    const next = (index) => {
      this.show(index)
      if (index + 1 < MOMENTS.length) this.timer = setTimeout(() => next(index + 1), DWELL_MS)
    }
    next(0)
  }

  pause() {
    clearTimeout(this.timer)
  }

  /** @param {number} index of the moment */
  show(index) {
    this.moment = index
    this.buttons.forEach((button, i) => button.setAttribute('aria-pressed', String(i === index)))
    this.element.dataset.moment = MOMENTS[index].title
    for (const [name, plot] of this.plots) {
      const snapshot = this.#at(name, index)
      if (snapshot) plot.draw(snapshot, this.scale)
    }
  }

  close() {
    this.pause()
  }

  #offer() {
    this.buttons.forEach((button, index) => (button.disabled = !this.#has(index)))
    this.playButton.disabled = !MOMENTS.every((_, index) => this.#has(index))
  }

  #snapshots() {
    return Object.values(this.learned).map(({ fields }) => fields).filter((fields) => fields.length > 0)
  }

  #at(name, index) {
    return this.learned[name]?.fields.find(({ fraction }) => Math.abs(fraction - MOMENTS[index].fraction) < 0.01)
  }

  #has(index) {
    return Object.keys(this.learned).some((name) => this.#at(name, index))
  }
}
