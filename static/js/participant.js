// participant.js — the participant's page: wires the parts and mounts the step the server names.
import { Api } from './api.js'
import { Banners } from './banners.js'
import { Live } from './live.js'
import { OnePress } from './one_press.js'
import { Scene } from './scene.js'
import { mountBlock } from './steps/block.js'
import { mountConsent } from './steps/consent.js'
import { mountEnd } from './steps/end.js'
import { mountPractice } from './steps/practice.js'
import { mountQueries } from './steps/queries.js'
import { mountQuestions } from './steps/questions.js'
import { mountWaiting } from './steps/waiting.js'
import { Visit } from './visit.js'
import { Way } from './way.js'
import { WithdrawDialog } from './withdraw_dialog.js'

/** @typedef {{visit: Visit, live: Live, scene: Scene, banners: Banners, announce: (sentence: string) => void, turn: () => void}} Context `turn` says that something else is on the page now */

// What names ways of steering is fetched only by those who may hear of them.
const MOUNTS = {
  consent: async () => mountConsent,
  practice: async () => mountPractice,
  queries: async () => mountQueries,
  training: async () => (visit.session.strategies.length > 0 ? (await import('./steps/training.js')).mountTraining : mountWaiting),
  driving: async () => (await import('./steps/driving.js')).mountDriving,
  block: async () => mountBlock,
  questions: async () => mountQuestions,
  end: async () => mountEnd,
}
// Of these there can be several, each a page of its own.
const ANEW = new Set(['queries', 'training', 'block', 'questions'])
const WITH_ARM = new Set(['queries', 'driving', 'block'])
const LIVE = new Set(['queries', 'training', 'driving', 'block'])

const base = location.pathname.replace(/\/+$/, '')
const root = document.getElementById('step')
const announcer = document.getElementById('announcer')
const banners = new Banners(document.getElementById('banners'))
const visit = new Visit(new Api(`${base}/api`), banners)
const live = new Live(`${location.origin.replace(/^http/, 'ws')}${base}/live`, banners)
const scene = new Scene(document.getElementById('stage'), `${base}/scene/`)
const way = new Way(document.getElementById('way'))
const press = new OnePress()
/** @type {Context} */
const context = { visit, live, scene, banners, announce: (sentence) => (announcer.textContent = sentence), turn: () => press.change() }

let mounted = null
let unmount = () => {}

async function follow({ step, key, way: stages, study }) {
  way.show(stages, study)
  const name = ANEW.has(step) ? key : step
  if (name === mounted) return
  const isFirst = mounted === null
  unmount()
  unmount = () => {}
  mounted = name
  document.body.dataset.ready = 'false'
  document.body.dataset.step = step
  document.body.dataset.layout = WITH_ARM.has(step) ? 'stage' : 'page'
  root.replaceChildren()
  scene.tools.replaceChildren()
  if (WITH_ARM.has(step)) scene.show()
  else scene.hide()
  if (LIVE.has(step)) live.open()
  const mount = await MOUNTS[step]()
  if (mounted !== name) return // meanwhile the person is somewhere else
  unmount = mount(root, context)
  context.turn()
  scrollTo(0, 0)
  // Who reads with a screen reader hears the new step's heading.
  if (!isFirst) root.querySelector('h1')?.focus({ preventScroll: true })
  document.body.dataset.ready = 'true'
}

new WithdrawDialog(visit, document.getElementById('foot'))
visit.watch(follow)
live.addEventListener('open', () => {
  scene.revive()
  void visit.refresh()
})
addEventListener('pageshow', (event) => {
  if (!event.persisted) return
  if (LIVE.has(document.body.dataset.step)) live.open()
  void visit.refresh()
})
addEventListener('pagehide', () => live.close())
document.addEventListener('visibilitychange', () => {
  if (document.visibilityState === 'visible') void visit.refresh()
})
void visit.refresh()
