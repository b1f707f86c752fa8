// participant.js — the participant's page: wires the parts and mounts the step the server names.
import { Api } from './api.js'
import { Banners } from './banners.js'
import { Live } from './live.js'
import { Scene } from './scene.js'
import { mountConsent } from './steps/consent.js'
import { mountDriving } from './steps/driving.js'
import { mountPractice } from './steps/practice.js'
import { mountQueries } from './steps/queries.js'
import { mountTraining } from './steps/training.js'
import { Visit } from './visit.js'
import { Way } from './way.js'

/** @typedef {{visit: Visit, live: Live, scene: Scene, banners: Banners, announce: (sentence: string) => void}} Context */

const MOUNTS = { consent: mountConsent, practice: mountPractice, queries: mountQueries, training: mountTraining, driving: mountDriving }
const WITH_ARM = new Set(['queries', 'driving'])
const LIVE = new Set(['queries', 'training', 'driving'])

const base = location.pathname.replace(/\/+$/, '')
const root = document.getElementById('step')
const announcer = document.getElementById('announcer')
const banners = new Banners(document.getElementById('banners'))
const visit = new Visit(new Api(`${base}/api`), banners)
const live = new Live(`${location.origin.replace(/^http/, 'ws')}${base}/live`, banners)
const scene = new Scene(document.getElementById('stage'), `${base}/scene/`)
const way = new Way(document.getElementById('way'))
/** @type {Context} */
const context = { visit, live, scene, banners, announce: (sentence) => (announcer.textContent = sentence) }

let mounted = null
let unmount = () => {}

function follow({ step }) {
  if (step === mounted) return
  const isFirst = mounted === null
  unmount()
  mounted = step
  document.body.dataset.ready = 'false'
  document.body.dataset.step = step
  document.body.dataset.layout = WITH_ARM.has(step) ? 'stage' : 'page'
  way.show(step)
  root.replaceChildren()
  scene.tools.replaceChildren()
  if (WITH_ARM.has(step)) scene.show()
  else scene.hide()
  if (LIVE.has(step)) live.open()
  unmount = MOUNTS[step](root, context)
  scrollTo(0, 0)
  // Who reads with a screen reader hears the new step's heading.
  if (!isFirst) root.querySelector('h1')?.focus({ preventScroll: true })
  document.body.dataset.ready = 'true'
}

visit.watch(follow)
live.addEventListener('open', () => {
  scene.revive()
  void visit.refresh()
})
addEventListener('pageshow', (event) => {
  if (!event.persisted) return
  if (LIVE.has(mounted)) live.open()
  void visit.refresh()
})
addEventListener('pagehide', () => live.close())
document.addEventListener('visibilitychange', () => {
  if (document.visibilityState === 'visible') void visit.refresh()
})
void visit.refresh()
