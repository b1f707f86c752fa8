// waiting.js — in a study: the robot learns, and what it learns is not told.
import { ApiError } from '../api.js'
import { pause } from '../backoff.js'
import { html } from '../element.js'
import { newId } from '../ids.js'

const POLL_MS = 400

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountWaiting(root, { visit, banners }) {
  const stop = new AbortController()
  const { signal } = stop
  const body = { id: newId() }
  const state = html('p', { class: 'lead', role: 'status', 'data-testid': 'training-state' }, 'This takes a few seconds. You may rest your hand.')
  const progress = html('progress', { max: 1, value: 0, 'aria-label': 'Learning' })
  const retry = html('button', { class: 'button', type: 'button', 'data-testid': 'retry', hidden: true, onclick: again }, 'Try again')
  const drive = html('button', { class: 'button primary large', type: 'button', 'data-testid': 'drive', disabled: true, onclick: goOn }, 'Drive the arm')
  root.append(html('article', { class: 'consent' },
    html('h1', { tabindex: -1 }, 'The robot learns from your answers'), state, progress,
    html('div', { class: 'consent-end' }, retry, drive)))

  async function watch() {
    while (!signal.aborted) {
      try {
        const training = await visit.api.get('training', signal)
        banners.clear('server')
        state.dataset.state = training.state
        progress.value = training.state === 'succeeded' ? 1 : training.fraction
        retry.hidden = training.state !== 'failed'
        if (training.state === 'failed') {
          state.textContent = training.error
          return
        }
        if (training.state === 'succeeded') {
          state.textContent = 'It is ready. Next you drive the arm.'
          drive.disabled = false
          return
        }
      } catch (error) {
        if (signal.aborted) return
        if (!(error instanceof ApiError) || !error.passes) return visit.explain(error)
        banners.show('server', `${error.sentence} This page keeps trying; the learning goes on meanwhile.`)
      }
      await pause(POLL_MS, signal).catch(() => {})
    }
  }

  async function again() {
    retry.hidden = true
    try {
      await visit.api.postSurely('training/retry', {}, { signal })
    } catch (error) {
      if (!signal.aborted) visit.explain(error)
    }
    void watch()
  }

  async function goOn() {
    drive.disabled = true
    try {
      visit.adopt(await visit.api.postSurely('driving', body, { signal, onTrouble: () => (state.textContent = 'Not saved yet, trying again…') }))
    } catch (error) {
      if (signal.aborted) return
      drive.disabled = false
      visit.explain(error)
    }
  }

  void watch()
  return () => stop.abort()
}
