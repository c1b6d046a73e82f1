// Asks for a key, in words for a person, and does again what was refused for want of one.
import {key, setKey} from './calls.js';
import {by} from './page.js';

const reasons = {
  '/problems/key-required': 'This server draws for people who have a key. Whoever runs it gives you one; it begins with rs_.',
  '/problems/key-unknown': 'The server does not know this key. A whole one looks like rs_…_… in one word: this one may be mistyped, incomplete or withdrawn.',
  '/problems/scope-missing': 'This key may look at jobs, but not do this. Whoever runs the server can give you one that may.',
};
let refused = new Set();  // what to do again

by('access').addEventListener('submit', event => {
  event.preventDefault();
  if (!setKey(by('key').value.trim())) {
    by('access-reason').textContent = 'That is not a key: keys are one word of letters, digits and underscores, and begin with rs_.';
    by('key').focus();
    return;
  }
  by('access').hidden = true;
  const again = refused;
  refused = new Set();
  for (const attempt of again) attempt();
});

/// Whether the error is a want of a key, which is then asked for; `attempt` is made again with it. Only what somebody has
/// just asked for draws the attention to the question.
export function asksForKey(error, attempt, isAskedFor = true) {
  if (error.status !== 401 && error.status !== 403) return false;
  refused.add(attempt);
  by('access-reason').textContent = reasons[error.problem?.type] ?? reasons['/problems/key-required'];
  by('access').hidden = false;
  by('key').value = key();
  if (isAskedFor) {
    by('access').scrollIntoView({block: 'nearest'});
    by('key').select();
  }
  return true;
}
