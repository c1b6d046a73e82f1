// The controls of the most used options, which show and change the text.
import {change, text} from './editor.js';
import {optionChange, parsed} from './json_text.js';
import {by} from './page.js';

const fields = ['width', 'height', 'samples_per_pixel', 'shadow_samples', 'acceleration'].map(by);
let waiting = {};  // name → what a control says and the text does not yet, for it is being typed, or the text is no JSON

/// Begins with what a reload found waiting; `onChange()` hears when that changes.
export function createOptions(found, onChange) {
  waiting = {...found};
  for (const field of fields) {
    field.addEventListener('input', () => { waiting[field.name] = field.value; onChange(); });
    field.addEventListener('change', () => { writeOptions(); onChange(); });
  }
  for (const [name, value] of Object.entries(waiting)) by(name).value = value;
  writeOptions();
}

export const waitingOptions = () => waiting;

/// Writes into the text what waits for it.
export function writeOptions() {
  for (const field of fields.filter(({name}) => name in waiting)) {
    const current = text();
    if (!parsed(current) || field.validity.badInput) continue;
    const {name, type} = field, value = waiting[name];
    delete waiting[name];
    field.removeAttribute('aria-invalid');
    change(optionChange(current, name, value === '' ? undefined : type === 'number' ? Number(value) : value));
  }
  showWaiting();
}

/// After the text has changed: what it says is shown, and what waited for it to be JSON is written.
export function readOptions() {
  const job = parsed(text());
  if (job) {
    const options = job.options ?? {};
    for (const field of fields) {
      if (!(field.name in waiting) && field !== document.activeElement) field.value = options[field.name] ?? '';
    }
    // Nobody is typing in a control: then it is not half of a number.
    if (!fields.includes(document.activeElement)) writeOptions();
  }
  showWaiting();
}

function showWaiting() {
  by('waiting').hidden = !Object.keys(waiting).length || parsed(text()) !== null;
}

/// Another text has been opened: what was waiting was meant for the last one.
export function forgetWaiting() {
  waiting = {};
  document.activeElement?.form === by('job') && fields.includes(document.activeElement) && document.activeElement.blur();
  readOptions();
}

/// Marks the controls that these errors are about.
export function markOptions(errors) {
  for (const field of fields) {
    if (errors.some(({pointer}) => pointer === `/options/${field.name}`)) field.setAttribute('aria-invalid', 'true');
    else field.removeAttribute('aria-invalid');
  }
}
