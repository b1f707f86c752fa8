// consent.js — what the study is, what is kept, and one button to agree.
import { html } from '../element.js'
import { newId } from '../ids.js'

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountConsent(root, { visit }) {
  const { consent } = visit.session
  const body = { id: newId(), version: consent.version }
  const stop = new AbortController()
  const text = html('div', { class: 'consent-text' })
  text.innerHTML = consent.html // the server lets none of the text's own HTML through
  const state = html('p', { class: 'quiet', role: 'status' })
  const button = html('button', { class: 'button primary large', type: 'button', 'data-testid': 'begin', onclick: agree }, 'I agree — begin')

  async function agree() {
    button.disabled = true
    state.textContent = 'One moment…'
    const onTrouble = () => (state.textContent = 'Not saved yet, trying again…')
    try {
      visit.adopt(await visit.api.postSurely('consent', body, { signal: stop.signal, onTrouble }))
    } catch (error) {
      button.disabled = false
      state.textContent = ''
      visit.explain(error)
    }
  }

  root.append(html('article', { class: 'consent' },
    html('h1', { tabindex: -1 }, consent.title),
    text,
    html('div', { class: 'consent-end' }, button, state)))
  return () => stop.abort()
}
