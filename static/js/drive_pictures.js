// drive_pictures.js — what a drive leaves to look at: the hand's way from above, and the stick's use.
import { svg } from './element.js'

const EDGE_M = 0.03

/** The hand's way with forward up and left to the left; `mark(place)` says where it is now. */
export class WayPicture {
  /** @param {[number, number, number][]} path in metres */
  constructor(path) {
    const across = path.map(([, y]) => -y)
    const along = path.map(([x]) => -x)
    const low = [Math.min(...across) - EDGE_M, Math.min(...along) - EDGE_M]
    const size = [Math.max(...across) + EDGE_M - low[0], Math.max(...along) + EDGE_M - low[1]]
    const points = across.map((x, index) => `${x.toFixed(4)},${along[index].toFixed(4)}`).join(' ')
    const dot = Math.max(...size) / 40
    this.spot = svg('circle', { class: 'way-now', r: dot, cx: across[0], cy: along[0] })
    this.element = svg('svg', { class: 'drive-picture', role: 'img', 'aria-label': 'The way of the hand from above', viewBox: `${low.join(' ')} ${size.join(' ')}` },
      svg('polyline', { class: 'way-line', points }),
      svg('circle', { class: 'way-begin', r: dot, cx: across[0], cy: along[0] }),
      this.spot)
  }

  /** @param {[number, number, number]} place */
  mark([x, y]) {
    this.spot.setAttribute('cx', String(-y))
    this.spot.setAttribute('cy', String(-x))
  }
}

/** @param {number[][]} shares of the pushed time: across from the left, then from the bottom */
export function stickPicture(shares) {
  const count = shares.length
  const most = Math.max(...shares.flat(), 1e-9)
  const cells = shares.flatMap((column, x) => column.map((share, y) =>
    svg('rect', { class: 'stick-cell', x, y: count - 1 - y, width: 1, height: 1, 'fill-opacity': (Math.sqrt(share / most)).toFixed(3) })))
  return svg('svg', { class: 'drive-picture', role: 'img', 'aria-label': 'How often the stick was where', viewBox: `0 0 ${count} ${count}` }, cells,
    svg('circle', { class: 'stick-edge', cx: count / 2, cy: count / 2, r: count / 2 - 0.1 }))
}
