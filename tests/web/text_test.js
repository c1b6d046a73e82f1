// What is done with the text, without a browser; and that the libraries are those that their list says.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {readFileSync, readdirSync} from 'node:fs';
import {test} from 'node:test';
import {indexOfByte, locator, optionChange, readable} from '../../clients/web/json_text.js';
import {temporary} from './harness.js';

const clients = new URL('../../clients/', import.meta.url);

test('a JSON Pointer is found in the text', () => {
  const json = '{"a": [1, {"b/c": "x, }"}, [2]], "d~": null}';
  const at = pointer => { const {from, to} = locator(json)(pointer); return json.slice(from, to); };
  assert.equal(at(''), json);
  assert.equal(at('/a/1/b~1c'), '"x, }"');
  assert.equal(at('/a/2/0'), '2');
  assert.equal(at('/d~0'), 'null');
  assert.equal(at('/a/1/missing'), '{"b/c": "x, }"}');
  assert.equal(locator('{"a": [1}')('/a/7'), null);
});

test('many places in a big scene are found as fast as one', () => {
  const json = readFileSync(new URL('scenes/thousand-spheres.json', clients), 'utf8');
  const fastest = count => Math.min(...Array.from({length: 5}, () => {
    const begin = performance.now(), at = locator(json);
    for (let i = 0; i < count; ++i) assert.ok(at(`/scene/objects/${i}`));
    return performance.now() - begin;
  }));
  const [one, many] = [fastest(1), fastest(100)];
  assert.ok(many < 10 * one, `${many} ms, and ${one} ms`);
});

test('bytes are counted as the server counts them', () => {
  const text = '{"name": "Größe", }';
  assert.equal(text[indexOfByte(text, Buffer.byteLength(text))], '}');
});

test('set out readably, a job is the same job, and no line is long', () => {
  for (const name of readdirSync(new URL('scenes/', clients)).filter(file => file.endsWith('.json'))) {
    const job = JSON.parse(readFileSync(new URL(`scenes/${name}`, clients), 'utf8'));
    const text = readable(job);
    assert.equal(JSON.stringify(JSON.parse(text)), JSON.stringify(job));
    assert.ok(text.split('\n').every(line => line.length < 200), name);
  }
});

test('an option is changed without touching the rest', () => {
  const changed = (text, name, value) => optionChange(text, name, value).reverse().reduce((all, {from, to, insert}) => all.slice(0, from) + insert + all.slice(to), text);
  assert.equal(changed('{"options": {"width":   1e2, "height": 3}}', 'width', 7), '{"options": {"width":   7, "height": 3}}');
  for (const [before, name, value, options] of [
    ['{"scene": {"a": [1.0]}}', 'width', 7, {width: 7}], ['{"scene": {}, "options": {}}', 'width', 7, {width: 7}],
    ['{"options": {"width": 1, "height": 2}}', 'width', undefined, {height: 2}], ['{}', 'acceleration', 'cbr', {acceleration: 'cbr'}],
  ]) {
    const after = changed(before, name, value);
    assert.deepEqual(JSON.parse(after).options, options);
    assert.equal(after.includes('1.0'), before.includes('1.0'), after);
  }
  const line = `{"scene": {"name": "${'x'.repeat(2000)}"}}`;
  assert.equal(changed(line, 'width', 7), `${line.slice(0, -1)},"options": {"width":7}}`);
});

test('libraries.js is what clients/web/libraries/make makes', () => {
  const made = temporary();
  const {status, stderr} = spawnSync(new URL('web/libraries/make', clients).pathname, [made], {encoding: 'utf8'});
  assert.equal(status, 0, stderr);
  assert.ok(readFileSync(made).equals(readFileSync(new URL('web/libraries.js', clients))));
});
