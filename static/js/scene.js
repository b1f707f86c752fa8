// scene.js — the 3-D picture of the arm: one iframe for the whole visit.
import { html } from './element.js'
import { keepInTime } from './picture_scale.js'

// A picture that has not said it is there by then is shown as it is.
const PATIENCE_MS = 8000

/** Listens to what the picture's page says of its own connection. */
export class Scene extends EventTarget {
  /** @param {HTMLElement} host @param {string} address */
  constructor(host, address) {
    super()
    this.host = host
    this.address = address
    /** @type {HTMLIFrameElement | null} */
    this.frame = null
    this.isConnected = false
    this.wasConnected = false
    this.timer = 0
    this.stopScaling = () => {}
    this.veil = html('div', { class: 'stage-veil', role: 'status' })
    this.tools = html('div', { class: 'stage-tools' })
    this.onMessage = (event) => this.#hear(event)
  }

  /** Show the picture, loading it the first time. */
  show() {
    this.host.hidden = false
    if (this.frame) return
    this.#cover('Bringing up the robot…')
    this.frame = /** @type {HTMLIFrameElement} */ (html('iframe', { title: '3-D view of the robot arm', src: this.address }))
    this.host.append(this.frame, this.tools, this.veil)
    addEventListener('message', this.onMessage)
    this.timer = setTimeout(() => this.#uncover(), PATIENCE_MS)
  }

  /** The picture stays alive behind. */
  hide() {
    this.host.hidden = true
  }

  /** Load it again if it never came up, as when the server was down at that moment. */
  revive() {
    if (this.frame && !this.wasConnected) this.frame.src = this.address
  }

  close() {
    clearTimeout(this.timer)
    this.stopScaling()
    removeEventListener('message', this.onMessage)
    this.host.replaceChildren()
    this.frame = null
  }

  #hear({ source, origin, data }) {
    if (!this.frame || source !== this.frame.contentWindow || origin !== location.origin) return
    if (data?.source !== 'joymap-scene') return
    clearTimeout(this.timer)
    if (data.type === 'connected') {
      this.isConnected = true
      if (!this.wasConnected) this.stopScaling = keepInTime(this.frame)
      this.wasConnected = true
      this.#uncover()
      this.dispatchEvent(new Event('connected'))
    } else if (data.type === 'closed') {
      this.isConnected = false
      this.#cover(this.wasConnected ? 'The picture is reconnecting…' : 'Bringing up the robot…')
    }
  }

  #cover(sentence) {
    this.veil.textContent = sentence
    this.veil.hidden = false
  }

  #uncover() {
    this.veil.hidden = true
  }
}
