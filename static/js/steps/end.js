// end.js — the last page: thanks, what becomes of what was given, and what a recruiting service wants to know.
import { ICONS, html, icon } from '../element.js'

const WORDS = {
  erased: 'Everything you gave is erased. Only your number and that you left are kept.',
  kept: 'What you gave stays with the study, marked as withdrawn: it is not analysed.',
}

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountEnd(root, { visit }) {
  const { end, state } = visit.session
  const said = html('p', { class: 'quiet', role: 'status' })
  const shown = html('code', { 'data-testid': 'code' }, end.code ?? '')
  const code = end.code && html('p', { class: 'code-line' }, html('span', {}, 'Your code:'), shown,
    html('button', { class: 'button', type: 'button', 'data-testid': 'copy', onclick: copy }, icon(ICONS.copy), 'Copy the code'), said)

  async function copy() {
    try {
      await navigator.clipboard.writeText(end.code)
      said.textContent = 'Copied.'
    } catch {
      // Where the browser does not let us: ready for the person's own copying.
      getSelection()?.selectAllChildren(shown)
      said.textContent = 'Please copy what is marked.'
    }
  }

  root.append(html('article', { class: 'consent', 'data-testid': 'end', 'data-state': state },
    html('h1', { tabindex: -1 }, state === 'withdrawn' ? 'Goodbye' : 'Done'),
    html('p', { class: 'lead' }, end.message),
    end.left && html('p', { 'data-testid': 'farewell' }, WORDS[end.left]),
    code,
    end.url && html('p', {}, html('a', { class: 'button primary large', href: end.url, rel: 'noreferrer', 'data-testid': 'return' }, 'Back to where you came from'))))
  return () => {}
}
