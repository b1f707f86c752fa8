// account.js — one's password and programs' keys; for owners, everyone's accounts and what was done.
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

at('password').addEventListener('submit', async (event) => {
  event.preventDefault()
  const { old, fresh } = Object.fromEntries(new FormData(at('password')))
  const changed = await attempt(() => api.post('password', { old, new: fresh }))
  if (changed === null) location.assign(`${ROOT}/login`)
})

at('token').addEventListener('submit', async (event) => {
  event.preventDefault()
  const { name, scope } = Object.fromEntries(new FormData(at('token')))
  const made = await attempt(() => api.post('tokens', { id: newId(), name, scope }))
  if (made) at('made').replaceChildren(linkCard({ label: `the program “${name}”`, link: made.token }, (card) => card.remove()))
  await drawTokens()
})

at('invite').addEventListener('submit', async (event) => {
  event.preventDefault()
  const { role } = Object.fromEntries(new FormData(at('invite')))
  const made = await attempt(() => api.post('invitations', { role }))
  if (made) at('made').replaceChildren(linkCard({ label: `a new ${role}`, ...made }, (card) => card.remove()))
})

async function drawTokens() {
  const found = await attempt(() => api.get('tokens'))
  at('tokens').replaceChildren(...(found?.tokens ?? []).map(({ id, name, scope, created_at, is_revoked }) => html('li', { class: 'bar' },
    html('b', {}, name), scope, moment(created_at),
    is_revoked ? html('span', { class: 'quiet' }, 'ended') : html('button', { class: 'button plain-text', type: 'button', onclick: async () => {
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

async function drawAudit() {
  const found = await attempt(() => api.get('audit?limit=100'))
  at('audit').replaceChildren(html('table', { class: 'table' },
    html('thead', {}, html('tr', {}, ['When', 'Who', 'What', 'To what'].map((name) => html('th', { scope: 'col' }, name)))),
    html('tbody', {}, (found?.entries ?? []).map(({ at: when, who, action, subject }) => html('tr', {}, html('td', {}, moment(when)), html('td', {}, who ?? 'the server'), html('td', {}, action), html('td', {}, subject ?? '–'))))))
}

await drawTokens()
if (may(me, 'owner')) {
  await drawAccounts()
  await drawAudit()
}
document.body.dataset.ready = 'true'
