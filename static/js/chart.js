// chart.js — the learning curves: how far the arm's moves are from the answers, step by step.
import { html, svg } from './element.js'

/** @typedef {{title: string, curve: [number, number][]}} Series */

const WIDTH = 520
const HEIGHT = 150
const LEFT = 12
const RIGHT = 150
const TOP = 14
const BOTTOM = 30

/** @param {Series[]} series @returns {{step: number, loss: number}} the largest of both; at least a little. */
export function extentOf(series) {
  const points = series.flatMap(({ curve }) => curve)
  return {
    step: Math.max(1, ...points.map(([step]) => step)),
    loss: Math.max(1e-12, ...points.map(([, loss]) => loss)),
  }
}

/** @param {number[]} wanted heights @param {number} gap @returns {number[]} the same, moved apart so that words do not overlap. */
export function spreadOut(wanted, gap) {
  const order = wanted.map((y, index) => ({ y, index })).sort((a, b) => a.y - b.y)
  for (let i = order.length - 2; i >= 0; i -= 1) order[i].y = Math.min(order[i].y, order[i + 1].y - gap)
  const placed = [...wanted]
  for (const { y, index } of order) placed[index] = y
  return placed
}

export class LossChart {
  constructor() {
    this.paper = svg('svg', { class: 'chart', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'img' })
    this.element = html('figure', { class: 'curves' },
      html('figcaption', {}, html('strong', {}, 'Learning curve'), html('span', { class: 'quiet small' }, 'lower: closer to your answers')), this.paper)
  }

  /** @param {Series[]} series */
  draw(series) {
    const shown = series.map((each, index) => ({ ...each, look: index === 0 ? '' : 'second' })).filter(({ curve }) => curve.length > 0)
    const extent = extentOf(shown)
    const x = (step) => LEFT + ((WIDTH - LEFT - RIGHT) * step) / extent.step
    const y = (loss) => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * Math.max(0, loss)) / extent.loss
    const base = HEIGHT - BOTTOM
    const labels = spreadOut(shown.map(({ curve }) => y(curve.at(-1)[1])), 20)
    this.paper.replaceChildren(
      svg('path', { class: 'chart-axis', d: `M${LEFT} ${TOP}V${base}H${WIDTH - RIGHT}` }),
      svg('text', { class: 'chart-words', x: LEFT, y: HEIGHT - 9 }, '0'),
      svg('text', { class: 'chart-words', x: WIDTH - RIGHT, y: HEIGHT - 9, 'text-anchor': 'end' }, `${extent.step} steps`),
      ...shown.flatMap(({ look, title, curve }, index) => {
        const [lastStep, lastLoss] = curve.at(-1)
        return [
          svg('polyline', { class: `chart-line ${look}`, points: curve.map(([step, loss]) => `${x(step).toFixed(1)},${y(loss).toFixed(1)}`).join(' ') }),
          svg('circle', { class: `chart-end ${look}`, cx: x(lastStep), cy: y(lastLoss), r: 3.5 }),
          svg('text', { class: 'chart-name', x: x(lastStep) + 10, y: labels[index] + 5 }, title),
        ]
      }))
    this.paper.setAttribute('aria-label', shown.map(({ title, curve }) => `${title}: from ${curve[0][1].toPrecision(2)} to ${curve.at(-1)[1].toPrecision(2)}`).join('; '))
  }
}
