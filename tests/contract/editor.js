// CodeMirror with its plugin for schemas: what it proposes and what it calls wrong. Arguments: the schema's file, one with good bodies.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {CompletionContext} from '@codemirror/autocomplete';
import {json} from '@codemirror/lang-json';
import {ensureSyntaxTree} from '@codemirror/language';
import {EditorState} from '@codemirror/state';
import {jsonCompletion, jsonSchemaLinter, stateExtensions} from 'codemirror-json-schema';

const [schema, bodies] = process.argv.slice(2).map(file => JSON.parse(readFileSync(file, 'utf8')));
const camera = '"camera": {"position": [0, 2, 8], "look_at": [0, 1, 0], "vertical_fov": 35}';

function stateOf(doc) {
  const state = EditorState.create({doc, extensions: [json(), stateExtensions(schema)]});
  ensureSyntaxTree(state, doc.length, 100000);
  // A state keeps the tree it was made with, which on a busy machine is half of one.
  return state.update({}).state;
}

/// The proposals where the text has a |, in the order of the alphabet.
function proposals(text) {
  const place = text.indexOf('|');
  const found = jsonCompletion()(new CompletionContext(stateOf(text.replace('|', '')), place, true));
  return (found.options ?? []).map(option => option.label).sort();
}
const faults = text => jsonSchemaLinter()({state: stateOf(text)}).map(fault => fault.message);
const withObject = object => `{"scene": {${camera}, "objects": [${object}]}}`;

assert.deepEqual(proposals(withObject('{"type": "sphere", "|"}')), ['center', 'material', 'radius']);
assert.deepEqual(proposals(withObject('{"type": "|"}')),
                 ['cylinder', 'group', 'instance', 'mesh', 'plane', 'polygon', 'sphere', 'triangle', 'tube']);
assert.deepEqual(proposals(`{"scene": {${camera}, "lights": [{"type": "directional", "|"}]}}`), ['angular_radius', 'direction', 'intensity']);
assert.deepEqual(proposals('{"options": {"acceleration": "|"}}'), ['bvh', 'cbr', 'groups', 'median', 'none']);
for (const member of ['position', 'look_at', 'direction', 'vertical_fov', 'view_plane', 'lens']) {
  assert.ok(proposals('{"scene": {"camera": {"|"}}}').includes(member), member);
}

for (const [name, body] of Object.entries(bodies)) assert.deepEqual(faults(JSON.stringify(body)), [], name);
assert.match(faults(withObject('{"type": "sphere", "center": [0, 1, 0]}'))[0], /`radius` is missing/);
assert.match(faults(withObject('{"type": "sphere", "center": [0, 1, 0], "radius": 1, "colour": 1}'))[0], /`colour`/);
assert.match(faults(withObject('{"type": "spere", "center": [0, 1, 0], "radius": 1}'))[0], /spere/);
