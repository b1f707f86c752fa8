// end.js — the last page: thanks, and what a recruiting service wants to know.
import { ICONS, html, icon } from '../element.js'

/** @param {HTMLElement} root @param {import('../participant.js').Context} context @returns {() => void} unmount */
export function mountEnd(root, { visit }) {
  const { end, state } = visit.session
  const words = html('span', {}, 'Copy')
  const code = end.code && html('p', { class: 'code-line' }, 'Your code: ', html('code', { 'data-testid': 'code' }, end.code),
    html('button', { class: 'button', type: 'button', onclick: async () => {
      await navigator.clipboard?.writeText(end.code).catch(() => {})
      words.textContent = 'Copied'
    } }, icon(ICONS.copy), words))
  root.append(html('article', { class: 'consent', 'data-testid': 'end', 'data-state': state },
    html('h1', { tabindex: -1 }, state === 'withdrawn' ? 'Goodbye' : 'Done'),
    html('p', { class: 'lead' }, end.message),
    code,
    end.url && html('p', {}, html('a', { class: 'button primary large', href: end.url, rel: 'noreferrer', 'data-testid': 'return' }, 'Back to where you came from'))))
  return () => {}
}
