// backoff.js — how long to wait before trying again.

/** Waits grow from `first` to `last` seconds; a little chance keeps pages from asking all at once. */
export class Backoff {
  /**
   * @param {number} [first_s]
   * @param {number} [last_s]
   * @param {() => number} [chance] in [0, 1)
   */
  constructor(first_s = 0.3, last_s = 5, chance = Math.random) {
    this.first_s = first_s
    this.last_s = last_s
    this.chance = chance
    this.reset()
  }

  reset() {
    this.next_s = this.first_s
  }

  /** @returns {number} milliseconds to wait this time. */
  step() {
    const wait_s = this.next_s
    this.next_s = Math.min(this.last_s, this.next_s * 1.8)
    return 1000 * wait_s * (0.85 + 0.3 * this.chance())
  }
}

/**
 * @param {number} wait_ms
 * @param {AbortSignal} [signal] ends the wait early, with a rejection.
 * @returns {Promise<void>}
 */
export function pause(wait_ms, signal) {
  return new Promise((resolve, reject) => {
    const stop = () => {
      clearTimeout(timer)
      reject(signal.reason)
    }
    if (signal?.aborted) return reject(signal.reason)
    const timer = setTimeout(() => {
      signal?.removeEventListener('abort', stop)
      resolve()
    }, wait_ms)
    signal?.addEventListener('abort', stop, { once: true })
  })
}
