// The scenes to begin with, and what they look like.
import {addressOf, readPatiently} from './calls.js';
import {readable} from './json_text.js';
import {by} from './page.js';

const first = 'hard-and-soft';
let examples = [];  // {name, path, picture}

/// `onWait()` hears, here and below, that the server is away.
export async function loadExamples(onWait) {
  examples = await (await readPatiently('/scenes/index.json', {onWait})).json();
  by('example').replaceChildren(new Option('choose one…', ''), ...examples.map(({name}) => new Option(name, name)));
}

export const firstExample = () => examples.some(({name}) => name === first) ? first : examples[0]?.name;

/// The address of its picture; nothing when there is no such example.
export function pictureOf(name) {
  const path = examples.find(example => example.name === name)?.picture;
  return path && addressOf(path);
}

export async function textOf(name, onWait) {
  return readable(await (await readPatiently(examples.find(example => example.name === name).path, {onWait})).json());
}
