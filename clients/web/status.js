// The line that says how things stand, its bar, and the tab's title.
import {by} from './page.js';

let name = '';

/// Of the job that the title tells of.
export function setName(text) {
  name = text;
}

/// `percent` only of what is under way or was; `title` is what the tab's title begins with.
export function showState(text, percent, title = percent === undefined ? '' : `${Math.floor(percent)} %`) {
  by('state').textContent = text;
  by('percent').textContent = percent === undefined ? '' : `${percent.toFixed(1)} %`;
  by('bar').value = percent ?? 0;
  const parts = [title, name].filter(Boolean);
  document.title = parts.length ? `${parts.join(' · ')} – Penumbra` : 'Penumbra';
}
