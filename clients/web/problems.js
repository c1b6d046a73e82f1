// What the server has against a job: told in words, with the places, which are underlined in the text.
import {mark, select, selectMarked, text} from './editor.js';
import {indexOfByte, locator} from './json_text.js';
import {markOptions} from './options.js';
import {by, element} from './page.js';

export function clearProblem() {
  by('errors').hidden = true;
  by('problem').textContent = '';
  by('error-list').replaceChildren();
  by('text').classList.remove('bad');
  markOptions([]);
  mark([]);
}

/// A problem document (RFC 9457).
export function showProblem(problem) {
  clearProblem();
  const errors = problem.errors ?? [];
  // The detail of a problem with a list says what the list says.
  const shown = errors.length ? [problem.title] : [problem.title, problem.detail];
  by('problem').textContent = shown.filter(Boolean).join(': ') || 'The server refused the job';
  by('error-list').replaceChildren(...errors.map(({pointer, detail}) => element('li', {}, element('button',
    {type: 'button', textContent: `${pointer || '(the whole body)'}: ${detail}`, onclick: () => selectMarked(pointer)}))));
  markOptions(errors);
  by('errors').hidden = false;
  if (errors.length) markPlaces(errors);
  else if (problem.status === 400) markEndOfJson(problem.detail);
  // After the editor, which scrolls the page as well, in the next frame.
  requestAnimationFrame(() => by('errors').scrollIntoView({block: 'nearest'}));
}

function markPlaces(errors) {
  by('text').classList.add('bad');
  const locate = locator(text());
  const ranges = errors.map(({pointer, detail}) => ({...locate(pointer), message: detail, source: pointer})).filter(range => 'from' in range);
  mark(ranges);
  if (ranges.length) select(ranges[0], false);
}

/// Where the text stops being JSON; the server counts bytes, from 1.
function markEndOfJson(detail = '') {
  const byte = detail.match(/^byte (\d+)/)?.[1];
  if (!byte) return;
  by('text').classList.add('bad');
  const current = text(), from = Math.min(indexOfByte(current, Number(byte)), current.length);
  const range = {from, to: Math.min(from + 1, current.length)};
  mark([{...range, message: detail, source: 'json'}]);
  select(range, false);
}
