// link_card.js — a fresh participant link, shown once, with a button to copy it.
import { ICONS, html, icon } from '../element.js'

/** @param {{label: string, link: string}} made @param {(card: HTMLElement) => void} onClose @returns {HTMLElement} */
export function linkCard({ label, link }, onClose) {
  const field = /** @type {HTMLInputElement} */ (html('input', {
    class: 'link-field', readonly: true, value: link, 'aria-label': `Link of ${label}`, 'data-testid': 'link', onfocus: () => field.select(),
  }))
  const words = html('span', {}, 'Copy')
  const copy = html('button', { class: 'button primary', type: 'button', 'data-testid': 'copy', onclick: async () => {
    words.textContent = (await copied(link, field)) ? 'Copied' : 'Press Ctrl+C'
    setTimeout(() => (words.textContent = 'Copy'), 2500)
  } }, icon(ICONS.copy), words)
  const card = html('section', { class: 'link-card', 'aria-label': `New link for ${label}` },
    html('h2', {}, `Link for ${label}`),
    html('p', { class: 'quiet small' }, 'It is shown only now. Who has it can use it, so keep it safe.'),
    html('div', { class: 'link-line' }, field, copy, html('button', { class: 'button plain-text', type: 'button', onclick: () => onClose(card) }, 'Done')))
  return card
}

/** The clipboard needs a secure context; the selected field serves elsewhere. */
async function copied(text, field) {
  try {
    await navigator.clipboard.writeText(text)
    return true
  } catch {
    field.focus()
    field.select()
    return document.execCommand('copy')
  }
}
