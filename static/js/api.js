// api.js — the server over HTTP: one way to ask, one type of error.
import { Backoff, pause } from './backoff.js'

/** @typedef {{x: number, y: number}} Stick x to the right, y up (forward), in the unit disc */
/** @typedef {{id: string, h: [number, number] | null}} Given */
/** @typedef {{id: string, position: number, answer: Given | null}} Query */
/** @typedef {{name: string, title: string, note: string, has_curve: boolean}} Strategy */
/**
 * @typedef {object} Session
 * @property {string} study
 * @property {'active' | 'completed' | 'withdrawn'} state
 * @property {'consent' | 'practice' | 'queries' | 'training' | 'driving' | 'block' | 'questions' | 'end'} step
 * @property {string} key names this step among those of its kind
 * @property {string | null} task its title
 * @property {string | null} task_name
 * @property {object | null} props what stands on the table, in metres
 * @property {{title: string, is_here: boolean, is_done: boolean}[]} way
 * @property {boolean} may_withdraw
 * @property {{position: number, of: number, drives_wanted: number, drives_made: number, may_continue: boolean, open_drive: string | null} | null} block
 * @property {any} questions
 * @property {{message: string, code: string | null, url: string | null, left: 'kept' | 'erased' | null} | null} end
 * @property {{version: string, title: string, html: string}} consent
 * @property {number} practice_s
 * @property {Query[]} queries
 * @property {number} labels_wanted
 * @property {boolean} may_end_early fewer answers may do
 * @property {string} field_says what the picture of a learned field shows
 * @property {Strategy[]} strategies
 * @property {boolean} may_switch_arrows whether the person may show where the stick leads
 * @property {import('./stick_settings.js').StickSettings} stick how the person has set it
 * @property {string | null} [notice] said when everything is answered but too little of it with the stick
 */

const PATIENCE_MS = 15000

/** What the server answered, or that it did not. */
export class ApiError extends Error {
  /**
   * @param {string} sentence for the person
   * @param {string} kind
   * @param {number} status 0: the server was not reached
   */
  constructor(sentence, kind, status) {
    super(sentence)
    this.sentence = sentence
    this.kind = kind
    this.status = status
  }

  /** Whether asking again later may help. */
  get passes() {
    return this.status === 0 || this.status === 429 || this.status >= 500
  }
}

export class Api {
  /** @param {string} base address that paths are put behind, without a slash at the end */
  constructor(base, fetcher = (...asked) => fetch(...asked)) {
    this.base = base
    this.fetcher = fetcher
  }

  /** @param {string} path @param {AbortSignal} [signal] */
  get(path, signal) {
    return this.#ask('GET', path, undefined, signal)
  }

  /** @param {string} path @param {object} body @param {AbortSignal} [signal] */
  post(path, body, signal) {
    return this.#ask('POST', path, body, signal)
  }

  /** @param {string} path @param {AbortSignal} [signal] */
  delete(path, signal) {
    return this.#ask('DELETE', path, undefined, signal)
  }

  /** @param {string} path @param {object} body @param {AbortSignal} [signal] */
  put(path, body, signal) {
    return this.#ask('PUT', path, body, signal)
  }

  /**
   * Post until the server has answered; the same body each time, so that it counts once.
   *
   * @param {string} path
   * @param {object} body with an id of its own
   * @param {{signal?: AbortSignal, onTrouble?: (error: ApiError) => void}} [options]
   */
  postSurely(path, body, options) {
    return this.#surely('POST', path, body, options)
  }

  /** As postSurely. @param {string} path @param {object} body @param {{signal?: AbortSignal, onTrouble?: (error: ApiError) => void}} [options] */
  putSurely(path, body, options) {
    return this.#surely('PUT', path, body, options)
  }

  async #surely(method, path, body, { signal, onTrouble } = {}) {
    const backoff = new Backoff()
    for (;;) {
      try {
        return await this.#ask(method, path, body, signal)
      } catch (error) {
        if (signal?.aborted || !(error instanceof ApiError) || !error.passes) throw error
        onTrouble?.(error)
        await pause(backoff.step(), signal)
      }
    }
  }

  async #ask(method, path, body, signal) {
    const patience = AbortSignal.timeout(PATIENCE_MS)
    const stop = new AbortController()
    const end = () => stop.abort()
    patience.addEventListener('abort', end, { once: true })
    signal?.addEventListener('abort', end, { once: true })
    let response, content
    try {
      signal?.throwIfAborted()
      response = await this.fetcher(`${this.base}/${path}`, {
        method,
        signal: stop.signal,
        cache: 'no-store',
        credentials: 'same-origin',
        headers: body === undefined ? { accept: 'application/json' } : { accept: 'application/json', 'content-type': 'application/json' },
        body: body === undefined ? undefined : JSON.stringify(body),
      })
      content = await response.text()
    } catch (error) {
      if (signal?.aborted) throw signal.reason
      throw new ApiError('The server cannot be reached just now.', 'unreachable', 0)
    } finally {
      signal?.removeEventListener('abort', end)
    }
    if (response.status === 204) return null
    const answer = parsed(content)
    if (response.ok && answer !== null) return answer
    const unknown = response.status >= 500 ? 'The server has trouble just now.' : 'The server answered in a way this page does not know.'
    const sentence = answer?.error?.sentence ?? unknown
    throw new ApiError(sentence, answer?.error?.kind ?? 'unknown', response.ok ? 502 : response.status)
  }
}

function parsed(content) {
  try {
    return JSON.parse(content)
  } catch {
    return null
  }
}
