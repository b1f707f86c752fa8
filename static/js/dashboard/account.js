// account.js — one's password, logins and programs' keys; for owners, everyone's accounts and what was done.
import { html } from '../element.js'
import { newId } from '../ids.js'
import { linkCard } from './link_card.js'
import { ROOT, api, attempt, may, moment, whoAmI } from './office.js'

const at = (name) => document.getElementById(name)
const ROLES = ['viewer', 'assistant', 'owner']
const me = await whoAmI()
at('title').textContent = me.name
at('role').textContent = `You are ${me.role === 'viewer' ? 'a viewer' : `an ${me.role}`}.`
at('owners').hidden = !may(me, 'owner')
at('token').hidden = !may(me, 'assistant')

at('password').addEventListener('submit', async (event) => {
  event.preventDefault()
  const { old, fresh } = Object.fromEntries(new FormData(at('password')))
  const changed = await attempt(() => api.post('password', { old, new: fresh }))
  if (changed === null) location.assign(`${ROOT}/login`)
})

at('token').addEventListener('submit', async (event) => {
  event.preventDefault()
  const { name, scope, days } = Object.fromEntries(new FormData(at('token')))
  const made = await attempt(() => api.post('tokens', { id: newId(), name, scope, days: days ? Number(days) : null }))
  if (made) at('made').replaceChildren(linkCard({ label: `the program “${name}”`, link: made.token }, (card) => card.remove()))
  await drawTokens()
})

at('invite').addEventListener('submit', async (event) => {
  event.preventDefault()
  const { role } = Object.fromEntries(new FormData(at('invite')))
  const made = await attempt(() => api.post('invitations', { role }))
  if (made) at('made').replaceChildren(linkCard({ label: `a new ${role}`, ...made }, (card) => card.remove()))
})

async function drawLogins() {
  const found = await attempt(() => api.get('logins'))
  at('logins').replaceChildren(...(found?.logins ?? []).map(({ id, created_at, is_this }) => html('li', { class: 'bar' },
    'since', moment(created_at),
    is_this ? html('b', {}, 'this browser') : html('button', { class: 'button plain-text', type: 'button', 'aria-label': `End the login of ${created_at}`, onclick: async () => {
      await attempt(() => api.delete(`logins/${id}`))
      await drawLogins()
    } }, 'End'))))
}

async function drawTokens() {
  const found = await attempt(() => api.get('tokens'))
  at('tokens').replaceChildren(...(found?.tokens ?? []).map(({ id, name, scope, created_at, expires_at, used_at, is_revoked }) => html('li', { class: 'bar' },
    html('b', {}, name), scope, html('span', { class: 'quiet' }, 'made ', moment(created_at), used_at ? ', used ' : ', never used', used_at && moment(used_at), expires_at && ', until ', expires_at && moment(expires_at)),
    is_revoked ? html('span', { class: 'quiet' }, 'ended') : may(me, 'assistant') && html('button', { class: 'button plain-text', type: 'button', 'aria-label': `End the key ${name}`, onclick: async () => {
      await attempt(() => api.delete(`tokens/${id}`))
      await drawTokens()
    } }, 'End'))))
}

async function drawAccounts() {
  const found = await attempt(() => api.get('accounts'))
  at('accounts').replaceChildren(...(found?.accounts ?? []).map(({ id, name, role, is_disabled }) => html('li', { class: 'bar' },
    html('b', {}, name),
    html('select', { 'aria-label': `Role of ${name}`, onchange: async (event) => {
      await attempt(() => api.post(`accounts/${id}`, { role: event.target.value }))
      await drawAccounts()
    } }, ROLES.map((each) => html('option', { value: each, selected: each === role }, each))),
    html('button', { class: 'button plain-text', type: 'button', onclick: async () => {
      await attempt(() => api.post(`accounts/${id}`, { disabled: !is_disabled }))
      await drawAccounts()
    } }, is_disabled ? 'Let in again' : 'Let in no more'))))
}

/** @type {any[]} */
let entries = []
/** @type {number | null} */
let next = null

async function drawAudit() {
  const found = await attempt(() => api.get(`audit?limit=100${next === null ? '' : `&before=${next}`}`))
  if (!found) return
  entries = [...entries, ...found.entries]
  next = found.next
  at('earlier').hidden = next === null
  at('audit').replaceChildren(html('table', { class: 'table' },
    html('thead', {}, html('tr', {}, ['When', 'Who', 'What', 'To what'].map((name) => html('th', { scope: 'col' }, name)))),
    html('tbody', {}, entries.map(({ at: when, who, action, subject }) => html('tr', {}, html('td', {}, moment(when)), html('td', {}, who ?? 'the server'), html('td', {}, action), html('td', {}, subject ?? '–'))))))
}

at('earlier').addEventListener('click', drawAudit)
await drawLogins()
await drawTokens()
if (may(me, 'owner')) {
  await drawAccounts()
  await drawAudit()
}
document.body.dataset.ready = 'true'
