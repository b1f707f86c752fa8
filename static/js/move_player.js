// move_player.js — has a question's move played in the picture, and shows how far it has come.
import { ICONS, html, icon } from './element.js'

// A picture still loading is worth waiting for, but not for ever.
const WAIT_MS = 4000
// The arm's shape appears a moment after the picture's line is up.
const SETTLE_MS = 500

export class MovePlayer {
  /** @param {import('./live.js').Live} live @param {import('./scene.js').Scene} scene @param {() => void} onAgain */
  constructor(live, scene, onAgain) {
    this.live = live
    this.scene = scene
    this.queryId = null
    this.timer = 0
    this.bar = html('span', { class: 'playback-bar' })
    this.again = html('button', { class: 'button', type: 'button', 'data-testid': 'play-again', 'aria-keyshortcuts': 'R', onclick: onAgain },
      icon(ICONS.replay), 'Play the move again', html('kbd', { 'aria-hidden': 'true' }, 'R'))
    this.playback = html('div', { class: 'playback', 'aria-hidden': 'true' }, this.bar)
    scene.tools.append(this.again, this.playback)
    this.listening = new AbortController()
    const { signal } = this.listening
    live.addEventListener('open', () => this.#playSoon(), { signal })
    scene.addEventListener('connected', () => this.#playSoon(SETTLE_MS), { signal })
    live.addEventListener('status', () => this.#draw(), { signal })
  }

  /** @param {string} queryId */
  play(queryId) {
    this.queryId = queryId
    this.#playSoon(this.scene.isConnected ? 0 : WAIT_MS)
  }

  close() {
    clearTimeout(this.timer)
    this.listening.abort()
    this.again.remove()
    this.playback.remove()
  }

  #playSoon(wait_ms = this.scene.isConnected ? SETTLE_MS : WAIT_MS) {
    clearTimeout(this.timer)
    if (this.queryId === null) return
    const show = () => this.live.send({ type: 'show', query_id: this.queryId })
    if (wait_ms === 0) show()
    else this.timer = setTimeout(show, wait_ms)
  }

  #draw() {
    const playback = this.live.status?.playback
    const isOurs = playback?.query_id === this.queryId
    this.playback.dataset.playing = String(isOurs)
    this.bar.style.transform = `scaleX(${isOurs ? playback.fraction : 0})`
  }
}
