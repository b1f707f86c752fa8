// element.js — makes an HTML or SVG element in one expression.
const SVG = 'http://www.w3.org/2000/svg'

/** @typedef {Record<string, string | number | boolean | null | undefined | ((event: any) => void)>} Attributes */
/** @typedef {Node | string | null | undefined | false} Child */

/**
 * @param {string} tag
 * @param {Attributes} [attributes] A function under `onclick` and the like becomes a listener.
 * @param {...(Child | Child[])} children
 * @returns {HTMLElement}
 */
export function html(tag, attributes, ...children) {
  return fill(document.createElement(tag), attributes, children)
}

/**
 * @param {string} tag
 * @param {Attributes} [attributes]
 * @param {...(Child | Child[])} children
 * @returns {SVGElement}
 */
export function svg(tag, attributes, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children)
}

/** A line icon; `path` is drawn on 24 by 24 units. */
export function icon(path) {
  return svg('svg', { viewBox: '0 0 24 24', 'aria-hidden': 'true' }, svg('path', { d: path }))
}

export const ICONS = Object.freeze({
  replay: 'M4 12a8 8 0 1 0 2.6-5.9M4 4v4.5h4.5',
  play: 'M8 5.5v13l10.5-6.5z',
  home: 'M4 11.5 12 5l8 6.5M6.5 10v9h11v-9',
  copy: 'M9 9h10v11H9zM5 15V4h10',
})

function fill(element, attributes = {}, children = []) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue
    if (typeof value === 'function') element.addEventListener(name.slice(2), value)
    else element.setAttribute(name, value === true ? '' : String(value))
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false))
  return element
}
