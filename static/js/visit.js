// visit.js — what the server last said about this person's visit.
import { ApiError } from './api.js'
import { Backoff, pause } from './backoff.js'

/** @typedef {import('./api.js').Session} Session */

export class Visit {
  /** @param {import('./api.js').Api} api @param {import('./banners.js').Banners} banners */
  constructor(api, banners) {
    this.api = api
    this.banners = banners
    /** @type {Session | null} */
    this.session = null
    this.watchers = new Set()
    this.asking = null
  }

  /** @param {Session} session */
  adopt(session) {
    this.session = session
    // A watcher may stop others: the step that is left hears nothing of the one that comes.
    for (const watcher of [...this.watchers]) if (this.watchers.has(watcher)) watcher(session)
  }

  /** @param {(session: Session) => void} watcher @returns {() => void} stops it. */
  watch(watcher) {
    this.watchers.add(watcher)
    return () => this.watchers.delete(watcher)
  }

  /** Ask where the person is, until the server says; once at a time. @returns {Promise<void>} */
  refresh() {
    this.asking ??= this.#ask().finally(() => (this.asking = null))
    return this.asking
  }

  /** Say what the server refused; the page may be behind another tab, so look where we are. @param {unknown} error */
  explain(error) {
    if (!(error instanceof ApiError)) {
      if (!(error instanceof DOMException && error.name === 'AbortError')) throw error
      return
    }
    this.banners.show('refused', error.sentence, { for_ms: 8000 })
    if (error.status === 409) void this.refresh()
  }

  async #ask() {
    const backoff = new Backoff()
    for (;;) {
      try {
        const session = await this.api.get('session')
        this.banners.clear('server')
        this.adopt(session)
        return
      } catch (error) {
        if (!(error instanceof ApiError)) throw error
        if (!error.passes) {
          this.banners.show('server', error.sentence)
          return
        }
        this.banners.show('server', `${error.sentence} This page keeps trying; nothing you did is lost.`)
        await pause(backoff.step())
      }
    }
  }
}
