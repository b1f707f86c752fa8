// office.js — what every page of experimenters has: the API, banners, who is logged in, and the way out.
import { Api, ApiError } from '../api.js'
import { pause } from '../backoff.js'
import { Banners } from '../banners.js'
import { html } from '../element.js'

/** The address of the dashboard's pages, without a slash at the end. */
export const ROOT = location.pathname.replace(/\/(dashboard|account|studies\/[^/]+|participants\/[^/]+(\/live)?)\/?$/, '')
export const api = new Api(`${ROOT}/api/v1`)
export const banners = new Banners(document.getElementById('banners'))

/** Do something with the server; what it refuses is said at the top. @template T @param {() => Promise<T>} action @returns {Promise<T | undefined>} */
export async function attempt(action) {
  try {
    const done = await action()
    banners.clear('refused')
    return done
  } catch (error) {
    if (!(error instanceof ApiError)) throw error
    if (error.status === 401) location.assign(`${ROOT}/login`)
    banners.show('refused', error.sentence)
  }
}

/** Do something every few seconds while the page is looked at, and go on trying. @param {number} every_ms @param {() => Promise<void>} action */
export async function keep(every_ms, action) {
  for (;;) {
    if (document.visibilityState === 'visible') {
      try {
        await action()
        banners.clear('server')
      } catch (error) {
        if (!(error instanceof ApiError)) throw error
        if (error.status === 401) return location.assign(`${ROOT}/login`)
        banners.show('server', error.passes ? `${error.sentence} This page keeps trying.` : error.sentence)
      }
      document.body.dataset.ready = 'true'
    }
    await pause(every_ms)
  }
}

/** Who is logged in, at the top. @returns {Promise<{id: string, name: string, role: 'viewer' | 'assistant' | 'owner'}>} */
export async function whoAmI() {
  const me = await attempt(() => api.get('me'))
  const leave = html('button', { class: 'button plain-text', type: 'button', 'data-testid': 'log-out', onclick: async () => {
    await attempt(() => api.post('logout', {}))
    location.assign(`${ROOT}/login`)
  } }, 'Log out')
  document.getElementById('who')?.replaceChildren(
    html('a', { href: `${ROOT}/dashboard` }, 'Studies'),
    html('a', { href: `${ROOT}/account` }, me?.name ?? ''), leave)
  return me ?? { id: '', name: '', role: 'viewer' }
}

export const may = (me, role) => ['viewer', 'assistant', 'owner'].indexOf(me.role) >= ['viewer', 'assistant', 'owner'].indexOf(role)

export function moment(iso) {
  if (!iso) return '–'
  const at = new Date(iso)
  return html('time', { datetime: iso, title: at.toLocaleString() }, at.toLocaleString([], { month: 'short', day: 'numeric', hour: '2-digit', minute: '2-digit' }))
}
