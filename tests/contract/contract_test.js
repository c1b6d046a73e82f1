// The document of the interface as strangers' tools meet it: linters find no error in it, three generators make clients of it,
// with which what the server takes compiles and what is misspelled does not, one of the clients gets a picture, and an editor
// knows what may be typed.
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {copyFileSync, mkdirSync, readFileSync, readdirSync, rmSync, symlinkSync, writeFileSync} from 'node:fs';
import {basename, dirname, join} from 'node:path';
import {createInterface} from 'node:readline';
import {after, before, test} from 'node:test';
import {fileURLToPath} from 'node:url';

const bin = process.argv[2];
const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, '..', '..');
const folder = join(bin, '..', 'contract');
const openapi = join(folder, 'openapi.json');
const schema = join(folder, 'scene.schema.json');
const generators = {
  'openapi-typescript': ['openapi-typescript', openapi, '--root-types', '--root-types-no-schema-prefix', '--output', 'client.ts'],
  'hey-api': ['openapi-ts', '--input', openapi, '--output', 'client', '--client', '@hey-api/client-fetch'],
  'orval': ['orval', '--input', openapi, '--output', './client.ts', '--client', 'fetch'],
};
let server, url;

before(async () => {
  rmSync(folder, {recursive: true, force: true});
  mkdirSync(folder);
  symlinkSync(join(here, 'node_modules'), join(folder, 'node_modules'));
  server = spawn(join(bin, 'penumbra'), ['serve', '--listen', '127.0.0.1:0', '--log-level', 'off', '--store', join(folder, 'store')],
                 {stdio: ['ignore', 'pipe', 'inherit']});
  for await (const line of createInterface(server.stdout)) {
    url = line.match(/^listening on (.*)$/)?.[1];
    if (url) break;
  }
  for (const file of [openapi, schema]) writeFileSync(file, await (await fetch(`${url}/v1/${basename(file)}`)).text());
});

after(async () => {
  const gone = new Promise(resolve => server.once('exit', resolve));
  server.kill('SIGTERM');
  await gone;
});

/// What a tool prints; that it succeeds is part of it.
function run([tool, ...flags], cwd = folder) {
  const env = {...process.env, REDOCLY_TELEMETRY: 'off', REDOCLY_SUPPRESS_UPDATE_NOTICE: 'true'};
  const done = spawnSync(join(here, 'node_modules', '.bin', tool), flags, {cwd, env, encoding: 'utf8', maxBuffer: 1 << 26});
  assert.equal(done.status, 0, `${tool}: ${done.error ?? ''}\n${(done.stdout + done.stderr).slice(0, 8000)}`);
  return done.stdout;
}

function runScript(...script) {
  const done = spawnSync(process.execPath, script, {encoding: 'utf8', timeout: 240000});
  assert.equal(done.status, 0, done.stdout + done.stderr);
}

/// Bodies that the server takes, by name, as text: the README's own, the example scenes, those of tests/api/corpus.
function goodBodies() {
  const read = (...path) => readFileSync(join(root, ...path), 'utf8');
  const bodies = {README: read('README.md').match(/```json\n([^]*?)```/)[1]};
  for (const name of readdirSync(join(root, 'clients', 'scenes')).filter(name => name.endsWith('.json'))) {
    bodies[name] = read('clients', 'scenes', name);
  }
  for (const {name, text, body} of JSON.parse(read('tests', 'api', 'corpus', 'good.json'))) bodies[name] = text ?? JSON.stringify(body);
  return `{\n${Object.entries(bodies).map(([name, text]) => `${JSON.stringify(name)}: ${text}`).join(',\n')}\n}`;
}

test('Redocly finds no error', () => {
  run(['redocly', 'lint', openapi, '--format', 'summary']);
});

test('Spectral finds no error', () => {
  writeFileSync(join(folder, 'spectral.json'), '{"extends": ["spectral:oas"]}');
  run(['spectral', 'lint', openapi, '--ruleset', 'spectral.json']);
});

for (const [name, command] of Object.entries(generators)) {
  test(`with the client of ${name} good bodies compile, misspelled ones do not`, () => {
    const project = join(folder, name);
    mkdirSync(project);
    run(command, project);
    for (const file of ['tsconfig.json', 'typos.ts']) copyFileSync(join(here, file), join(project, file));
    const constants = `export const bodies = ${goodBodies()} satisfies Record<string, JobRequest>;`;
    writeFileSync(join(project, 'bodies.ts'), `import type {JobRequest} from './client';\n${constants}\n`);
    run(['tsc', '--project', project, '--noEmit']);
  });
}

test('the client of hey-api gets a picture, and is told what is wrong', () => {
  const project = join(folder, 'hey-api');
  copyFileSync(join(here, 'render.ts'), join(project, 'render.ts'));
  run(['tsc', '--project', project]);
  runScript(join(project, 'js', 'render.js'), url);
});

test('an editor proposes by the schema and finds what is wrong', () => {
  // With each level of groups the plugin takes nearly twice the time, and these are 25.
  const {'groups in groups': _, ...shallow} = JSON.parse(goodBodies());
  const bodies = join(folder, 'bodies.json');
  writeFileSync(bodies, JSON.stringify(shallow));
  run(['esbuild', join(here, 'editor.js'), '--bundle', '--platform=node', '--outfile=editor.cjs', '--log-level=error']);
  runScript(join(folder, 'editor.cjs'), schema, bodies);
});
