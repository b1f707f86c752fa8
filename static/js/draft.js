// draft.js — a questionnaire on its way to being sent: what was said so far, kept in the tab.
import { newId } from './ids.js'

/** @typedef {{key: string, kind: 'scale' | 'choice' | 'text' | 'strategy', text: string, low: number, high: number, step: number, low_label: string, high_label: string, choices: string[]}} Item */
/** @typedef {number | string | null} Value null: would rather not say */
/** @typedef {Record<string, {value: Value, answered_at: string}>} Given */

const ORDINALS = ['First', 'Second', 'Third', 'Fourth', 'Fifth', 'Sixth', 'Seventh', 'Eighth', 'Ninth', 'Tenth']
const PREFIX = 'joymap questions '

/** @param {Item} item @param {number} ways how many ways of steering there were @returns {{value: number | string, title: string, end: string}[] | null} what can be chosen; null: it is answered in words */
export function optionsOf(item, ways) {
  if (item.kind === 'text') return null
  if (item.kind === 'choice') return item.choices.map((title) => ({ value: title, title, end: '' }))
  if (item.kind === 'strategy') return Array.from({ length: ways }, (_, index) => ({ value: index + 1, title: `${ORDINALS[index] ?? `${index + 1}th`} way`, end: '' }))
  const last = Math.floor((item.high - item.low) / item.step)
  return Array.from({ length: last + 1 }, (_, index) => {
    const value = item.low + index * item.step
    return { value, title: String(value), end: index === 0 ? item.low_label : index === last ? item.high_label : '' }
  })
}

export class Draft {
  /**
   * @param {Item[]} items
   * @param {string} key of the step
   * @param {string} base tells one person's drafts from another's
   * @param {Storage | null} [storage]
   * @param {() => Date} [now]
   */
  constructor(items, key, base, storage = tabStorage(), now = () => new Date()) {
    this.items = items
    this.key = key
    this.storage = storage
    this.now = now
    this.place = `${PREFIX}${base} ${key}`
    const kept = this.#kept()
    /** The id under which it is sent, however often. */
    this.id = typeof kept?.id === 'string' ? kept.id : newId()
    /** @type {Given} */
    this.given = {}
    for (const { key: name } of items) if (kept?.given?.[name]?.answered_at) this.given[name] = kept.given[name]
    this.#keep()
  }

  /** @param {Item} item @returns {Value | undefined} undefined: nothing yet */
  valueOf(item) {
    return this.given[item.key]?.value
  }

  /** @param {Item} item @param {Value} value */
  give(item, value) {
    this.given[item.key] = { value, answered_at: this.now().toISOString() }
    this.#keep()
  }

  /** @param {Item} item */
  take(item) {
    delete this.given[item.key]
    this.#keep()
  }

  /** @returns {Item[]} */
  get open() {
    return this.items.filter(({ key }) => this.given[key] === undefined)
  }

  /** What is sent: the same each time. */
  get body() {
    return { id: this.id, key: this.key, responses: this.items.map(({ key }) => ({ item: key, ...this.given[key] })) }
  }

  /** It is sent. */
  forget() {
    try {
      this.storage?.removeItem(this.place)
    } catch {
      // Nothing could be kept there either.
    }
  }

  #keep() {
    try {
      this.storage?.setItem(this.place, JSON.stringify({ id: this.id, given: this.given }))
    } catch {
      // A full or forbidden storage: the draft then lives as long as the page.
    }
  }

  #kept() {
    try {
      return JSON.parse(this.storage?.getItem(this.place) ?? 'null')
    } catch {
      return null
    }
  }
}

/** Forget all drafts of somebody who leaves. @param {string} base @param {Storage | null} [storage] */
export function forgetDrafts(base, storage = tabStorage()) {
  try {
    const places = Array.from({ length: storage?.length ?? 0 }, (_, index) => storage?.key(index) ?? '')
    for (const place of places) if (place.startsWith(`${PREFIX}${base} `)) storage?.removeItem(place)
  } catch {
    // Nothing could be kept there either.
  }
}

function tabStorage() {
  try {
    return sessionStorage
  } catch {
    return null
  }
}
