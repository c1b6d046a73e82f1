// The page behind docker/Caddyfile, with TLS, and below a path of such a proxy.
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {get} from 'node:https';
import {createServer} from 'node:net';
import {join} from 'node:path';
import {chooseQuick, chooseSlow, server, state, temporary, testPage, until, visit} from './harness.js';

const caddyfile = readFileSync(new URL('../../docker/Caddyfile', import.meta.url), 'utf8');

/// The same file, whose site has the server below a path and nothing else. (Of itself Caddy says 200 of what there is not.)
const below = path => {
  const [all, head, site] = caddyfile.match(/^([^]*\n\{\$PENUMBRA_SITE[^\n]*\{\n)([^]*)\n\}\n$/);
  assert.ok(site.includes('reverse_proxy'), all);
  return `${head}handle_path ${path}* {\n${site}\n}\nrespond 404\n}\n`;
};

const freePort = () => new Promise(resolve => {
  const probe = createServer().listen(0, '127.0.0.1', () => {
    const {port} = probe.address();
    probe.close(() => resolve(port));
  });
});

/// Whether something answers there, whatever it says: a bare machine knows no name, and its certificate is nobody's.
const answers = port => new Promise(resolve => {
  get({host: '127.0.0.1', port, servername: 'localhost', rejectUnauthorized: false}, answer => resolve(answer.resume() && true)).on('error', () => resolve(false));
});

/// Runs Caddy with its own authority before the server that all tests share; `run(origin)`.
async function withCaddy(text, run) {
  const folder = temporary(), config = join(folder, 'Caddyfile'), port = await freePort(), origin = `https://localhost:${port}`;
  mkdirSync(folder);
  // Neither the system's store of authorities nor port 80 is a test's to touch.
  writeFileSync(config, text.replace('admin off', 'admin off\n\tskip_install_trust\n\tauto_https disable_redirects'));
  const env = {...process.env, HOME: folder, XDG_DATA_HOME: folder, XDG_CONFIG_HOME: folder, PENUMBRA_SITE: origin, PENUMBRA_UPSTREAM: new URL(server.url).host};
  const caddy = spawn('caddy', ['run', '--config', config, '--adapter', 'caddyfile'], {env, stdio: ['ignore', 'ignore', 'pipe']});
  let said = '', isGone = false;
  const gone = new Promise(resolve => caddy.once('exit', resolve)).then(() => { isGone = true; });
  caddy.stderr.on('data', data => { said += data; });
  try {
    while (!await answers(port)) {
      assert.ok(!isGone, said);
      await new Promise(resolve => setTimeout(resolve, 50));
    }
    await run(origin);
  } finally {
    caddy.kill('SIGKILL');
    await gone;
  }
}

for (const [where, text, path] of [['behind docker/Caddyfile', caddyfile, '/'], ['below a path of a proxy', below('/render/'), '/render/']]) {
  testPage(`${where} everything works`, page => withCaddy(text, async origin => {
    const lost = [];
    page.on('response', answer => answer.status() >= 400 && lost.push(answer.url()));
    await visit(page, origin + path);
    await until(page, () => document.querySelector('#picture').naturalWidth > 0);
    await chooseSlow(page);
    await page.click('#render');
    await until(page, () => document.querySelector('#picture').alt === 'The picture so far');
    await page.click('#cancel');
    await state(page, 'Canceled');
    await chooseQuick(page);
    await page.click('#render');
    await state(page, 'Done');
    await page.reload();
    await until(page, () => document.querySelector('#picture').naturalWidth === 64);
    await until(page, () => document.querySelector('#job-list img').naturalWidth > 0);
    const schema = await page.evaluate(async () => (await fetch([...document.links].find(link => link.textContent.startsWith('What a scene')).href)).status);
    assert.equal(schema, 200);
    assert.equal(await page.evaluate(async () => (await fetch(document.querySelector('#download').href)).status), 200);
    assert.deepEqual(lost, []);
  }), {url: null, ignoreHTTPSErrors: true});
}
