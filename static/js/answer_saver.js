// answer_saver.js — an answer on its way to the server; it survives a lost line and a reload.

/** @typedef {{id: string, query_id: string, h: [number, number] | null, thinking_time_s: number}} AnswerBody */

export class AnswerSaver {
  /** @param {import('./api.js').Api} api @param {Storage | null} storage */
  constructor(api, storage = tabStorage()) {
    this.api = api
    this.storage = storage
    this.place = `joymap answer ${api.base}`
  }

  /** @returns {AnswerBody | null} what an earlier load of this page could not hand in. */
  get unsaved() {
    try {
      return JSON.parse(this.storage?.getItem(this.place) ?? 'null')
    } catch {
      return null
    }
  }

  /**
   * @param {AnswerBody} body the same each time it is tried
   * @param {{signal: AbortSignal, onTrouble: () => void}} options
   * @returns {Promise<import('./api.js').Session>}
   */
  async save(body, { signal, onTrouble }) {
    this.#keep(JSON.stringify(body))
    try {
      return await this.api.postSurely('answers', body, { signal, onTrouble })
    } finally {
      // Answered, refused, or the questions are over; only a page that goes away leaves it behind.
      this.#keep(null)
    }
  }

  #keep(content) {
    try {
      if (content === null) this.storage?.removeItem(this.place)
      else this.storage?.setItem(this.place, content)
    } catch {
      // A full or forbidden storage costs only the survival of a reload.
    }
  }
}

function tabStorage() {
  try {
    return sessionStorage
  } catch {
    return null
  }
}
