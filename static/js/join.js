// join.js — the page of a study's shared link: who presses the button gets a link of their own.
import { Api, ApiError } from './api.js'
import { newId } from './ids.js'

const NAMES = ['PROLIFIC_PID', 'workerId', 'participant', 'id'] // how recruiting services name people
const [, base, token] = /^(.*\/join)\/([^/]+)\/?$/.exec(location.pathname)
const said = document.getElementById('said')
const button = /** @type {HTMLButtonElement} */ (document.getElementById('join'))
const asked = new URLSearchParams(location.search)
const external_id = NAMES.map((name) => asked.get(name)).find(Boolean) ?? null

// A press whose answer was lost is sent again with the same id, also by a page that was loaded again.
const PRESS = `joymap joining ${token}`

function pressId() {
  try {
    const id = sessionStorage.getItem(PRESS) ?? newId()
    sessionStorage.setItem(PRESS, id)
    return id
  } catch {
    return ownId
  }
}
const ownId = newId()

function forgetPress() {
  try {
    sessionStorage.removeItem(PRESS) // who comes next in this tab is somebody else
  } catch {
    // Then it was not kept either.
  }
}

function say(error) {
  if (!(error instanceof ApiError)) throw error
  said.textContent = error.sentence
}

button.addEventListener('click', async () => {
  button.disabled = true
  try {
    const { link } = await new Api(base).post(token, { id: pressId(), external_id })
    forgetPress()
    // To the same server by the address that this page was opened with.
    location.replace(new URL(link).pathname.replace(/^.*(?=\/p\/)/, base.replace(/\/join$/, '')))
  } catch (error) {
    button.disabled = false
    say(error)
  }
})

try {
  const { title, is_open } = await new Api(`${base}/${token}`).get('study')
  document.getElementById('title').textContent = title
  document.title = `${title} – Joymap`
  said.textContent = is_open ? 'Thank you for your interest. The next page tells what it is about, and you can stop at any time.' : 'This study takes in nobody new at the moment. If you took part before, you can go on.'
  button.hidden = false
} catch (error) {
  say(error)
}
