// socket.js — a websocket that comes back by itself.
import { Backoff } from './backoff.js'

// The server speaks at least once a second; after this silence the line is taken for dead.
const SILENCE_MS = 4500

/** Calls `onOpen`, `onClosed` (once for each loss) and `onMessage` with parsed JSON. */
export class LiveSocket {
  /** @param {string | (() => string)} url or what makes one for each connection @param {{onOpen: () => void, onClosed: () => void, onMessage: (message: any) => void}} hooks */
  constructor(url, hooks, { Socket = WebSocket, backoff = new Backoff() } = {}) {
    this.url = url
    this.hooks = hooks
    this.Socket = Socket
    this.backoff = backoff
    this.socket = null
    this.isClosed = false
    this.isLost = false
    this.timer = 0
    this.onOnline = () => this.hurry()
    addEventListener('online', this.onOnline)
    this.#connect()
  }

  get isOpen() {
    return this.socket?.readyState === 1
  }

  /** @returns {boolean} whether it went out; a message of the moment is not kept for later. */
  send(message) {
    if (!this.isOpen) return false
    this.socket.send(JSON.stringify(message))
    return true
  }

  /** Try now rather than after the wait. */
  hurry() {
    if (this.isClosed || this.socket) return
    this.backoff.reset()
    this.#connect()
  }

  close() {
    this.isClosed = true
    clearTimeout(this.timer)
    removeEventListener('online', this.onOnline)
    this.socket?.close()
    this.socket = null
  }

  #connect() {
    clearTimeout(this.timer)
    const socket = new this.Socket(typeof this.url === 'string' ? this.url : this.url())
    this.socket = socket
    this.#listenFor(socket)
    socket.onopen = () => {
      if (this.socket !== socket) return
      this.backoff.reset()
      this.isLost = false
      this.#listenFor(socket)
      this.hooks.onOpen()
    }
    socket.onmessage = (event) => {
      if (this.socket !== socket) return
      this.#listenFor(socket)
      this.hooks.onMessage(JSON.parse(event.data))
    }
    socket.onclose = () => this.#lose(socket)
  }

  #listenFor(socket) {
    clearTimeout(this.timer)
    this.timer = setTimeout(() => {
      socket.close()
      this.#lose(socket)
    }, SILENCE_MS)
  }

  #lose(socket) {
    if (this.socket !== socket || this.isClosed) return
    this.socket = null
    clearTimeout(this.timer)
    if (!this.isLost) {
      this.isLost = true
      this.hooks.onClosed()
    }
    this.timer = setTimeout(() => this.#connect(), this.backoff.step())
  }
}
