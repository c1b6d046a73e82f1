// The text of a job: how it is set out, where in it something stands, and how an option is changed in it.
import {findNodeAtLocation, modify, parseTree} from './libraries.js';

const lineLength = 110;

/// JSON as people read it: what fits in a line is one, and long lists of numbers are as wide as that.
export function readable(value, indent = '') {
  const short = oneLine(value);
  if (typeof value !== 'object' || value === null || indent && short.length + indent.length <= lineLength) return short;
  const inner = `${indent}  `;
  const isList = Array.isArray(value);
  if (isList && value.every(item => typeof item === 'number')) return `[\n${filled(value, inner)}\n${indent}]`;
  const lines = isList ? value.map(item => inner + readable(item, inner))
    : Object.entries(value).map(([key, item]) => `${inner}${JSON.stringify(key)}: ${readable(item, inner)}`);
  const [open, close] = isList ? '[]' : '{}';
  return lines.length ? `${open}\n${lines.join(',\n')}\n${indent}${close}` : open + close;
}

function oneLine(value) {
  if (typeof value !== 'object' || value === null) return JSON.stringify(value);
  if (Array.isArray(value)) return `[${value.map(oneLine).join(', ')}]`;
  return `{${Object.entries(value).map(([key, item]) => `${JSON.stringify(key)}: ${oneLine(item)}`).join(', ')}}`;
}

function filled(numbers, indent) {
  const lines = [];
  for (const number of numbers) {
    const last = lines.at(-1);
    if (last !== undefined && last.length + `${number}`.length + 2 <= lineLength) lines[lines.length - 1] += `, ${number}`;
    else lines.push(indent + number);
  }
  return lines.join(',\n');
}

/// The job in a text, or nothing when the text is not (yet) one.
export function parsed(text) {
  try {
    const value = JSON.parse(text);
    return value && typeof value === 'object' && !Array.isArray(value) ? value : null;
  } catch {
    return null;
  }
}

/// Says where in a JSON text the value of a JSON Pointer (RFC 6901) stands: {from, to}, or the nearest parent that is there;
/// nothing when the text is not JSON. The text is parsed once for all pointers.
export function locator(text) {
  const errors = [];
  const tree = parseTree(text, errors);
  return pointer => tree && !errors.length ? locate(tree, pointer) : null;
}

function locate(tree, pointer) {
  const path = pointer.split('/').slice(1).map(part => part.replaceAll('~1', '/').replaceAll('~0', '~'));
  let node = tree;
  for (const part of path) {
    const child = findNodeAtLocation(node, [node.type === 'array' ? Number(part) : part]);
    if (!child) break;
    node = child;
  }
  return {from: node.offset, to: node.offset + node.length};
}

/// The n-th byte, from 1, of the text in UTF-8 is part of this character.
export function indexOfByte(text, number) {
  return new TextDecoder().decode(new TextEncoder().encode(text).slice(0, Math.max(0, number - 1))).length;
}

/// What to change in the text of a job for an option to have the value, undefined for none: [{from, to, insert}].
export function optionChange(text, name, value) {
  const {options} = parsed(text);
  if (options?.[name] === value) return [];
  if (options !== undefined && (typeof options !== 'object' || options === null)) return [];
  // What formats the new lines would format a whole job that stands in one.
  const formattingOptions = /^.{1000}/m.test(text) ? undefined : {insertSpaces: true, tabSize: 2};
  const edits = modify(text, ['options', name], value, {formattingOptions});
  return edits.map(({offset, length, content}) => ({from: offset, to: offset + length, insert: content}));
}
