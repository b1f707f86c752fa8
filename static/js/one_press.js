// one_press.js — one press does one thing, also where the page changes under the hand.

const DOUBLE_MS = 700

/** @param {{detail: number, timeStamp: number}} click @param {number} changed_ms when what is on the page came @returns {boolean} whether it is the rest of a double click that began on what was there before */
export function isLeftOver({ detail, timeStamp }, changed_ms) {
  return detail > 1 && timeStamp - changed_ms < DOUBLE_MS
}

/** Lets the second half of a double click, and a key that is held, not reach what came meanwhile. */
export class OnePress {
  constructor() {
    this.changed_ms = -Infinity
    document.addEventListener('click', (event) => {
      if (isLeftOver(event, this.changed_ms)) stop(event)
    }, true)
    document.addEventListener('keydown', (event) => {
      if (event.repeat && event.key === 'Enter' && event.target instanceof Element && event.target.closest('button, a, input')) event.preventDefault()
    }, true)
  }

  /** Something else is on the page now. */
  change() {
    this.changed_ms = performance.now()
  }
}

function stop(event) {
  event.preventDefault()
  event.stopPropagation()
}
