// training.js — the robot learns; then what it learned, to look at before driving.
import { ApiError } from '../api.js'
import { pause } from '../backoff.js'
import { html } from '../element.js'
import { newId } from '../ids.js'
import { LearnedPanel } from '../learned.js'
import { counted, durationInWords } from '../words.js'

const POLL_MS = 200

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountTraining(root, { visit, banners }) {
  const stop = new AbortController()
  const { signal } = stop
  const body = { id: newId() }
  const panel = new LearnedPanel(visit.session)
  const heading = html('h1', { tabindex: -1 }, 'The robot learns how you steer')
  const state = html('p', { class: 'lead', role: 'status', 'data-testid': 'training-state' }, 'Asking how far it is…')
  const progress = html('progress', { max: 1, value: 0, 'aria-label': 'Learning' })
  const retry = html('button', { class: 'button', type: 'button', 'data-testid': 'retry', hidden: true, onclick: again }, 'Try again')
  const drive = html('button', { class: 'button primary large', type: 'button', 'data-testid': 'drive', disabled: true, onclick: goOn }, 'Drive the arm')
  panel.element.hidden = true
  root.append(html('div', { class: 'training' },
    html('div', { class: 'training-head' },
      html('div', { class: 'training-words' }, heading, state, progress),
      html('div', { class: 'training-end' }, retry, drive)),
    panel.element))

  const answers = visit.session.queries.filter(({ answer }) => answer?.h).length

  function show(training) {
    state.dataset.state = training.state
    progress.hidden = training.state === 'succeeded' || training.state === 'failed'
    progress.value = training.fraction
    retry.hidden = training.state !== 'failed'
    drive.disabled = training.state !== 'succeeded'
    if (training.state === 'queued') state.textContent = 'Waiting for its turn…'
    else if (training.state === 'running') state.textContent = training.attempt > 1 ? `Learning from your answers, attempt ${training.attempt}…` : 'Learning from your answers…'
    else if (training.state === 'failed') state.textContent = training.error ?? 'The learning did not finish. Your answers are safe.'
    else state.textContent = learnedIn(training.training_s, answers)
    if (training.state === 'succeeded') heading.textContent = 'The robot has learned how you steer'
    panel.element.hidden = training.state === 'failed'
    panel.update(training.strategies ?? {})
  }

  async function watch() {
    for (;;) {
      try {
        const training = await visit.api.get('training', signal)
        banners.clear('server')
        show(training)
        if (training.state === 'failed') return
        if (training.state === 'succeeded') {
          if (!matchMedia('(prefers-reduced-motion: reduce)').matches) panel.play()
          return
        }
      } catch (error) {
        if (signal.aborted) return
        if (!(error instanceof ApiError) || !error.passes) return visit.explain(error)
        banners.show('server', `${error.sentence} This page keeps trying; the learning goes on meanwhile.`)
        await pause(1000, signal).catch(() => {})
      }
      if (signal.aborted) return
      await pause(POLL_MS, signal).catch(() => {})
    }
  }

  async function again() {
    retry.hidden = true
    try {
      show(await visit.api.postSurely('training/retry', {}, { signal }))
    } catch (error) {
      retry.hidden = false
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
  return () => {
    stop.abort()
    panel.close()
  }
}

function learnedIn(training_s, answers) {
  const from = `from ${counted(answers, 'answer')}.`
  return training_s === null ? `Learned ${from}` : `Learned in ${durationInWords(training_s)} ${from}`
}
