// field.js — the learned field from above: how the hand moves for each push of the stick.
import { html, svg } from './element.js'
import { PUSHES, arrowPaths, boundsOf, meanMove, spacingOf } from './field_geometry.js'
import { directionInWords } from './words.js'

const WORDS = { up: 'forward', down: 'back', left: 'left', right: 'right' }
const TURNS = { up: 0, right: 90, down: 180, left: 270 }

/** One strategy's picture. */
export class FieldPlot {
  /** @param {string} title @param {string} note */
  constructor(title, note) {
    this.paper = svg('svg', { class: 'field-paper', role: 'img' })
    this.element = html('figure', { class: 'field' },
      html('figcaption', {}, html('strong', {}, title), html('span', { class: 'quiet small' }, note)),
      html('div', { class: 'field-frame' }, this.paper))
  }

  clear() {
    this.paper.replaceChildren()
    this.paper.setAttribute('aria-label', 'Nothing learned yet.')
  }

  /** @param {import('./field_geometry.js').Snapshot} snapshot @param {number} scale */
  draw({ arrows }, scale) {
    const space = spacingOf(arrows)
    const box = boundsOf([{ fraction: 0, arrows }])
    const edge = space * 0.62
    this.paper.setAttribute('viewBox', [box.x - edge, box.y - edge, box.width + 2 * edge, box.height + 2 * edge].join(' '))
    const paths = PUSHES.flatMap((push) => {
      const { shafts, heads } = arrowPaths(arrows, push, scale, space * 0.8)
      return [
        svg('path', { class: `field-shaft ${push}`, d: shafts, 'stroke-width': space * 0.045 }),
        svg('path', { class: `field-head ${push}`, d: heads }),
      ]
    })
    const points = arrows.map(({ at: [forward, left] }) => svg('circle', { class: 'field-point', cx: -left, cy: -forward, r: space * 0.045 }))
    this.paper.replaceChildren(svg('g', { class: 'field-arrows' }, paths, points))
    this.paper.setAttribute('aria-label', `Top view. On average, ${PUSHES.map((push) => `pushing ${WORDS[push]} moves the hand ${directionInWords(meanMove(arrows, push))}`).join('; ')}.`)
  }
}

/** @returns {HTMLElement} which colour is which push. */
export function fieldLegend() {
  return html('ul', { class: 'legend small', 'aria-label': 'Colours: where the hand goes when you push the stick' },
    PUSHES.map((push) => html('li', { class: push },
      svg('svg', { viewBox: '0 0 20 20', 'aria-hidden': 'true' }, svg('path', { d: 'M10 17V6M5.5 9 10 3.5 14.500 9', transform: `rotate(${TURNS[push]} 10 10)` })),
      WORDS[push])))
}
