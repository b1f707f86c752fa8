// drive_words.js — a drive and its measures in words, for tables.

/**
 * @typedef {object} Measures
 * @property {number} completion_time_s
 * @property {number} path_length_m
 * @property {number} undo_share
 * @property {number} idle_time_s
 * @property {number} evenness
 * @property {number | null} touches
 * @property {number | null} spills
 * @property {Record<string, number>} counts
 * @property {boolean | null} is_success
 */

export const HOLDS = { released: 'Released', silent: 'No signal', edge: 'At the edge', 'moving-home': 'Going back to the start', 'by-itself': 'Moving by itself' }

/** @param {Measures} measures @returns {[string, string][]} a name and a value each; what a task does not have is left out. */
export function measuresInWords({ completion_time_s, path_length_m, undo_share, idle_time_s, evenness, touches, spills, is_success }) {
  const lines = [
    ['Time', `${completion_time_s.toFixed(1)} s`],
    ['Way of the hand', `${(100 * path_length_m).toFixed(0)} cm`],
    ['Undoing', percent(undo_share)],
    ['At rest', `${idle_time_s.toFixed(1)} s`],
    ['Evenness', percent(evenness)],
  ]
  if (touches !== null) lines.push(['Touches', String(touches)])
  if (spills !== null) lines.push(['Spilt', String(spills)])
  if (is_success !== null) lines.push(['Achieved', is_success ? 'yes' : 'no'])
  return lines
}

/** @param {string | null} end */
export function endInWords(end) {
  return end === null ? 'going on' : end
}

function percent(share) {
  return `${(100 * share).toFixed(0)} %`
}
