// Servers that go and come back, and streams that are refused.
import assert from 'node:assert/strict';
import {choose, chooseQuick, chooseSlow, renderQuick, server, start, state, temporary, testPage, type, until, visit} from './harness.js';

/// The server that comes back is another process with the same store at the same address.
async function withRestarts(page, run) {
  const store = temporary();
  let server = await start(['--store', store]);
  const {host} = new URL(server.url);
  await visit(page, server.url);
  try {
    await run(() => server.stop(), async () => { server = await start(['--store', store], host); });
  } finally {
    await server.stop();
  }
}

testPage('a job whose server goes and comes back is followed to its end', page => withRestarts(page, async (stop, begin) => {
  await chooseSlow(page);
  await page.click('#render');
  await state(page, 'Rendering');
  await stop();
  await state(page, 'The server does not answer');
  await begin();
  await state(page, 'Rendering');
  await page.click('#cancel');
  await state(page, 'Canceled');
}), {url: null});

testPage('a job that is sent while the server is away is sent once it is back, and once only', page => withRestarts(page, async (stop, begin) => {
  await chooseQuick(page);
  await stop();
  await page.click('#render');
  await state(page, 'The server does not answer');
  assert.ok(await page.isEnabled('#cancel'));
  await begin();
  await state(page, 'Done');
  await until(page, () => document.querySelectorAll('#job-list li').length === 1);
}), {url: null});

testPage('a job whose server goes is canceled once it is back', page => withRestarts(page, async (stop, begin) => {
  await chooseSlow(page);
  await page.click('#render');
  await state(page, 'Rendering');
  await stop();
  await state(page, 'The server does not answer; it is asked again');
  await page.click('#cancel');
  await state(page, 'The server does not answer; the job is canceled as soon as it does');
  // It is asked again meanwhile, and that changes nothing.
  await page.waitForTimeout(2500);
  assert.match(await page.textContent('#state'), /the job is canceled/);
  await begin();
  await state(page, 'Canceled');
}), {url: null});

testPage('a job whose answer is lost is sent again, and is one job', page => withRestarts(page, async () => {
  await chooseQuick(page);
  let sent = 0;
  await page.route('**/v1/jobs', async route => {
    if (route.request().method() !== 'POST' || sent++) return route.continue();
    await route.fetch();
    await route.abort();
  });
  await page.click('#render');
  await state(page, 'Done');
  assert.equal(sent, 2);
  assert.equal((await page.evaluate(async () => (await fetch('v1/jobs')).json())).jobs.length, 1);
}), {url: null});

testPage('the first example and another one are waited for, and the page says so', async page => {
  const comes = async path => {
    await page.unroute(path);
    await until(page, async () => (await import('./editor.js')).text() !== '');
    await state(page, 'Nothing rendered yet');
  };
  for (const path of ['**/scenes/index.json', '**/scenes/hard-and-soft.json']) {
    await page.evaluate(() => { onpagehide = () => [sessionStorage, localStorage].forEach(storage => storage.clear()); });
    await page.route(path, route => route.abort());
    await page.goto(server.url);
    await page.reload();
    await state(page, 'The server does not answer');
    await comes(path);
  }
  await page.route('**/scenes/cow.json', route => route.abort());
  await page.selectOption('#example', 'cow');
  await state(page, 'The server does not answer; the example comes as soon as it does');
  await comes('**/scenes/cow.json');
  await choose(page, 'cow');
});

testPage('whoever does not want to wait for the server need not', page => withRestarts(page, async (stop, begin) => {
  await chooseQuick(page);
  await stop();
  await page.click('#render');
  await state(page, 'The server does not answer');
  await page.click('#cancel');
  await state(page, 'Not sent');
  await type(page, ' ');
  assert.ok(await page.isEnabled('#render'));
  await begin();
  await page.click('#render');
  await state(page, 'Done');
}), {url: null});

const withoutRoom = {status: 200, contentType: 'text/event-stream', body: 'retry: 200\n\n'};
for (const [what, answer] of [['is refused', {status: 503}], ['ends at once, as there is no room for it,', withoutRoom]]) {
  testPage(`a stream that ${what} is asked for again`, async page => {
    await chooseSlow(page);
    let answered = 0, asked = 0;
    await page.route('**/events', route => answered++ ? route.continue() : route.fulfill(answer));
    const again = page.waitForRequest(request => request.url().endsWith('/events') && ++asked === 2);
    await page.click('#render');
    await again;
    await page.click('#cancel');
    await state(page, 'Canceled');
  });
}

testPage('the end of a job is seen though its stream is refused for ever', async page => {
  await chooseQuick(page);
  await page.route('**/events', route => route.fulfill({status: 429}));
  await page.click('#render');
  await state(page, 'Done');
});

testPage('a job the server has forgotten leaves the page usable', async page => {
  await chooseQuick(page);
  await page.route('**/events', route => route.fulfill({status: 404}));
  await page.click('#render');
  await state(page, 'The server no longer knows this job');
  assert.ok(await page.isDisabled('#cancel'));
  await page.unrouteAll();
  await renderQuick(page, {width: 66, height: 48});
});

testPage('an end that may not be asked for yet is asked for again', async page => {
  await chooseQuick(page);
  let refused = 0;
  await page.route('**/v1/jobs/*', route => refused++ === 0 ? route.fulfill({status: 429, headers: {'Retry-After': '1'}}) : route.continue());
  await page.click('#render');
  await state(page, 'Done');
  assert.ok(refused > 1);
});
