// drive_link.js — keeps a drive open and says where the stick is, 30 times a second.
import { ApiError } from './api.js'
import { newId } from './ids.js'

const SAY_MS = 1000 / 30
// The server may need a moment to tell of a drive it has opened.
const GRACE_MS = 1500

export class DriveLink {
  /**
   * @param {import('./visit.js').Visit} visit
   * @param {import('./live.js').Live} live
   * @param {import('./stick_inputs.js').StickInputs} inputs
   */
  constructor(visit, live, inputs) {
    this.visit = visit
    this.live = live
    this.inputs = inputs
    this.seq = 0
    this.openedAt_ms = -Infinity
    this.stop = new AbortController()
    /** @type {AbortController | null} */
    this.opening = null
    /** @type {string | null} null: the server knows which */
    this.strategy = ''
    /** @type {string | null} a drive that goes on, to be taken up again after a reload */
    this.wanted = null
    this.isRefused = false
    /** Whether all is driven: a drive that is gone stays gone. */
    this.isDone = false
    const { signal } = this.stop
    this.timer = setInterval(() => this.#say(), SAY_MS)
    live.addEventListener('status', () => this.#check(), { signal })
    document.addEventListener('visibilitychange', () => this.hold(), { signal })
    addEventListener('blur', () => document.hasFocus() || this.hold(), { signal })
  }

  get isOpening() {
    return this.opening !== null
  }

  /** Open a drive; the one before ends. @param {string | null} strategy */
  async open(strategy) {
    this.strategy = strategy
    const id = this.wanted ?? newId()
    this.wanted = null
    this.isRefused = false
    this.opening?.abort()
    const opening = new AbortController()
    this.opening = opening
    try {
      await this.visit.api.postSurely('drives', strategy === null ? { id } : { id, strategy }, { signal: opening.signal })
      this.openedAt_ms = performance.now()
    } catch (error) {
      if (opening.signal.aborted) return
      this.isRefused = error instanceof ApiError
      this.visit.explain(error)
    } finally {
      if (this.opening === opening) this.opening = null
    }
  }

  hold() {
    this.live.send({ type: 'hold' })
  }

  close() {
    clearInterval(this.timer)
    this.stop.abort()
    this.opening?.abort()
    this.hold()
  }

  /** The server holds no drive (we just came, it was restarted, an hour went by): open one. */
  #check() {
    const isLost = this.live.status?.mode !== 'driving' && this.live.status?.has_stick
    if (isLost && !this.isDone && !this.isOpening && !this.isRefused && performance.now() - this.openedAt_ms > GRACE_MS) void this.open(this.strategy)
  }

  #say() {
    const { status } = this.live
    if (document.visibilityState !== 'visible' || status?.mode !== 'driving' || !status.has_stick) return
    const now_ms = performance.now()
    const { x, y } = this.inputs.read(now_ms)
    this.seq += 1
    this.live.send({ type: 'stick', seq: this.seq, x, y, sent_ms: now_ms, ...this.inputs.source(now_ms) })
  }
}
