// template.js — the protocol a new study begins with: the paper's.
export const TEMPLATE = Object.freeze({
  title: 'Which way of steering do people prefer?',
  tasks: [
    { task: 'avoid', labels: 7, time_limit_s: 120 },
    { task: 'pour-cup', labels: 10, time_limit_s: 180 },
    { task: 'fetch-and-pour', labels: 30, unlabelled: 2000, time_limit_s: 180 },
  ],
  strategies: ['no-align', 'no-priors', 'all-priors'],
  order: 'williams',
  participants: 12,
  questionnaires: { after_each_strategy: ['steering'], after_each_task: ['preference'], at_the_end: [] },
})

export const TASKS = Object.freeze({ avoid: 'Go round', 'pour-cup': 'Pour a cup', 'fetch-and-pour': 'Fetch and pour' })
export const STRATEGIES = Object.freeze(['no-align', 'no-priors', 'proportionality', 'reversibility', 'consistency', 'all-priors', 'task-space'])
export const ORDERS = Object.freeze({ williams: 'Williams design (balanced)', random: 'Every order', fixed: 'Always the same' })
