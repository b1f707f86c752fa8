// live.js — the live line to the arm: what it does, and what we ask of it.
import { newId } from './ids.js'
import { LiveSocket } from './socket.js'

/**
 * @typedef {object} Status
 * @property {'idle' | 'showing' | 'driving'} mode
 * @property {boolean} has_stick
 * @property {string | null} strategy
 * @property {string | null} drive_id
 * @property {null | 'released' | 'silent' | 'edge' | 'moving-home' | 'by-itself' | 'over'} hold
 * @property {import('./attempt_panel.js').Progress | null} progress of a task that has an end
 * @property {[number, number]} stick
 * @property {[number, number, number]} hand in metres
 * @property {[number, number, number, number]} hand_wxyz
 * @property {null | {query_id: string, fraction: number, duration_s: number}} playback
 * @property {boolean} arrows whether the picture shows where the stick leads
 */

// A loss shorter than this is not worth a word.
const CALM_MS = 700

/** One for the visit; steps listen to 'status', 'open' and 'closed'. */
export class Live extends EventTarget {
  /** @param {string} url without query @param {import('./banners.js').Banners} banners */
  constructor(url, banners) {
    super()
    this.url = `${url}?tab=${newId()}`
    this.connections = 0
    this.banners = banners
    /** @type {Status | null} */
    this.status = null
    this.socket = null
    this.timer = 0
  }

  get isOpen() {
    return this.socket?.isOpen ?? false
  }

  /** Connect, if not connected yet. */
  open() {
    if (this.socket) {
      this.socket.hurry()
      return
    }
    this.socket = new LiveSocket(() => `${this.url}&generation=${this.connections++}`, {
      onOpen: () => this.#opened(),
      onClosed: () => this.#closed(),
      onMessage: (message) => this.#hear(message),
    })
  }

  /** @param {object} message @returns {boolean} whether it went out. */
  send(message) {
    return this.socket?.send(message) ?? false
  }

  close() {
    clearTimeout(this.timer)
    this.banners.clear('live')
    this.socket?.close()
    this.socket = null
    this.status = null
  }

  #opened() {
    clearTimeout(this.timer)
    this.banners.clear('live')
    this.dispatchEvent(new Event('open'))
  }

  #closed() {
    this.status = null
    clearTimeout(this.timer)
    this.timer = setTimeout(() => this.banners.show('live', 'The line to the robot is down. It holds still; this page is reconnecting…'), CALM_MS)
    this.dispatchEvent(new Event('closed'))
  }

  #hear(message) {
    if (message.type === 'status') {
      this.status = message
      this.dispatchEvent(new Event('status'))
    } else if (message.type === 'error') {
      this.banners.show('live-error', message.sentence, { for_ms: 6000 })
    }
  }
}
