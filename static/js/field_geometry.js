// field_geometry.js — where a learned field's arrows go on paper. No page in here.

/** @typedef {[number, number]} Pair */
/** @typedef {{at: Pair, up: Pair, down: Pair, left: Pair, right: Pair}} Arrows metres, in the robot's frame */
/** @typedef {{fraction: number, arrows: Arrows[]}} Snapshot */

/** @type {readonly ('up' | 'down' | 'left' | 'right')[]} */
export const PUSHES = Object.freeze(['up', 'down', 'left', 'right'])

/**
 * From the robot's frame (x forward, y to its left) to paper seen from behind the robot
 * (x to the right, y downwards).
 *
 * @param {Pair} at @returns {Pair}
 */
export function toPaper([forward, left]) {
  return [-left, -forward]
}

/** @param {Snapshot[]} snapshots @returns {{x: number, y: number, width: number, height: number}} on paper, in metres */
export function boundsOf(snapshots) {
  const points = snapshots.flatMap(({ arrows }) => arrows.map(({ at }) => toPaper(at)))
  const xs = points.map(([x]) => x)
  const ys = points.map(([, y]) => y)
  const x = Math.min(...xs)
  const y = Math.min(...ys)
  return { x, y, width: Math.max(...xs) - x, height: Math.max(...ys) - y }
}

/** @param {Arrows[]} arrows @returns {number} the usual distance to the nearest other point, in metres. */
export function spacingOf(arrows) {
  const nearest = arrows.map(({ at }, i) =>
    Math.min(...arrows.filter((_, j) => j !== i).map((other) => Math.hypot(other.at[0] - at[0], other.at[1] - at[1]))))
  return quantile(nearest, 0.5) || 0.05
}

/**
 * One scale for all pictures of a training, so that they can be compared: in the end a long arrow
 * reaches about half way to the next point.
 *
 * @param {Snapshot[][]} strategies @returns {number} metres on paper for a metre of movement
 */
export function arrowScale(strategies) {
  const lasts = strategies.map((snapshots) => snapshots.at(-1)).filter(Boolean)
  const lengths = lasts.flatMap(({ arrows }) => arrows.flatMap((point) => PUSHES.map((push) => Math.hypot(...point[push]))))
  const long = quantile(lengths, 0.9)
  return long > 0 ? (0.46 * spacingOf(lasts[0].arrows)) / long : 1
}

/**
 * @param {Arrows[]} arrows @param {'up' | 'down' | 'left' | 'right'} push
 * @param {number} scale @param {number} longest on paper; what is longer is cut
 * @returns {{shafts: string, heads: string}} path data of all arrows for one push.
 */
export function arrowPaths(arrows, push, scale, longest) {
  let shafts = ''
  let heads = ''
  for (const point of arrows) {
    const [x, y] = toPaper(point.at)
    let [dx, dy] = toPaper(point[push]).map((part) => part * scale)
    const length = Math.hypot(dx, dy)
    if (length < longest * 0.02) continue
    const cut = Math.min(1, longest / length)
    dx *= cut
    dy *= cut
    const size = Math.min(longest * 0.3, length * cut)
    const [ux, uy] = [dx / (length * cut), dy / (length * cut)]
    const [bx, by] = [x + dx - ux * size, y + dy - uy * size]
    shafts += `M${n(x)} ${n(y)}L${n(bx + ux * size * 0.3)} ${n(by + uy * size * 0.3)}`
    heads += `M${n(x + dx)} ${n(y + dy)}L${n(bx - uy * size * 0.48)} ${n(by + ux * size * 0.48)}L${n(bx + uy * size * 0.48)} ${n(by - ux * size * 0.48)}Z`
  }
  return { shafts, heads }
}

/** @param {Arrows[]} arrows @param {'up' | 'down' | 'left' | 'right'} push @returns {import('./api.js').Stick} the mean move, as the person sees it. */
export function meanMove(arrows, push) {
  const sum = arrows.reduce(([x, y], point) => [x + point[push][0], y + point[push][1]], [0, 0])
  return { x: -sum[1] / arrows.length, y: sum[0] / arrows.length }
}

function quantile(values, share) {
  const sorted = values.filter(Number.isFinite).sort((a, b) => a - b)
  return sorted.length === 0 ? 0 : sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))]
}

function n(value) {
  return value.toFixed(4)
}
