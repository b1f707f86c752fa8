// picture_scale.js — how finely the picture is drawn: coarser where drawing holds up the stick.

// Without a graphics card a full-size picture takes a second, and the stick waits as long: the
// picture's page shares its thread with ours.
const WANTED_MS = 50
const SLOW_MS = 90
const SAMPLES = 5
const SMALLEST = 0.3
// A smaller frame than this cuts the picture off instead of shrinking it.
const LEAST_PX = 240

/** Fed with the time between frames; only ever coarser, so that it does not swing. */
export class PictureScale {
  constructor() {
    this.scale = 1
    this.reset()
  }

  /** Forget what was measured, as after a pause. */
  reset() {
    /** @type {number[]} */
    this.frames = []
  }

  /** @param {number} frame_ms @returns {boolean} whether the scale changed. */
  feed(frame_ms) {
    this.frames.push(frame_ms)
    if (this.frames.length < SAMPLES) return false
    const [, , median] = [...this.frames].sort((a, b) => a - b)
    this.frames.shift()
    if (median < SLOW_MS || this.scale === SMALLEST) return false
    // The time to draw goes with the number of pixels, so with the square of the scale.
    const step = Math.min(0.85, Math.max(0.5, Math.sqrt(WANTED_MS / median)))
    this.scale = Math.max(SMALLEST, this.scale * step)
    this.reset()
    return true
  }
}

/**
 * Keep a frame's picture as fine as this machine can draw it in time.
 *
 * @param {HTMLIFrameElement} frame @returns {() => void} stops it.
 */
export function keepInTime(frame) {
  const picture = new PictureScale()
  let last_ms = null
  let request = requestAnimationFrame(function next(now_ms) {
    request = requestAnimationFrame(next)
    const isShown = document.visibilityState === 'visible' && frame.offsetParent !== null
    if (!isShown) {
      last_ms = null
      picture.reset()
      return
    }
    if (last_ms !== null && picture.feed(now_ms - last_ms)) {
      const stage = frame.parentElement.getBoundingClientRect()
      const floor = Math.min(1, LEAST_PX / Math.min(stage.width, stage.height))
      const scale = Math.max(picture.scale, floor)
      frame.style.width = frame.style.height = `${100 * scale}%`
      frame.style.transform = `scale(${1 / scale})`
      frame.dataset.scale = scale.toFixed(2)
      last_ms = null
      return
    }
    last_ms = now_ms
  })
  return () => cancelAnimationFrame(request)
}
