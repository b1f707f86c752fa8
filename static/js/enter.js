// enter.js — a name and a password, for an account that is made or one that is there.
import { Api, ApiError } from './api.js'

const form = /** @type {HTMLFormElement} */ (document.getElementById('enter'))
const said = document.getElementById('said')
const button = form.querySelector('button')

form.addEventListener('submit', async (event) => {
  event.preventDefault()
  button.disabled = true
  said.textContent = ''
  const { name, password } = Object.fromEntries(new FormData(form))
  const address = new URL(form.getAttribute('action') ?? location.href, location.href).pathname
  const cut = address.lastIndexOf('/')
  try {
    await new Api(address.slice(0, cut)).post(address.slice(cut + 1), { name, password })
    location.replace(form.dataset.then)
  } catch (error) {
    if (!(error instanceof ApiError)) throw error
    said.textContent = error.sentence
    button.disabled = false
  }
})
