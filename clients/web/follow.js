// A job's events (text/event-stream), read with fetch, for an EventSource cannot send a key.
import {Refusal, call, isAway, pause, readPatiently} from './calls.js';

const silenceMs = 45000;  // the server says something every 15 s

export const isFinal = state => ['succeeded', 'failed', 'canceled'].includes(state);

/// Comes back when the job has ended. `onProgress({percent, eta_s, state})` hears how it stands, `onWait()` that the server
/// is away. Throws a Refusal when the job may not be followed.
export async function follow(job, {onProgress, onWait, signal}) {
  let lastId = '', waitMs = 1000;
  for (;;) {
    let error = null;
    try {
      const answer = await call(job.links.events, {signal, headers: lastId ? {'Last-Event-ID': lastId} : {}});
      if (answer.status === 204) return;
      for await (const {id, event, data, retry} of eventsOf(answer.body)) {
        waitMs = Number(retry) || waitMs;
        lastId = id ?? lastId;
        if (isFinal(event)) return;
        if (event === 'progress') onProgress(JSON.parse(data));
      }
    } catch (caught) {
      error = caught;
      if (signal.aborted || error instanceof Refusal && [401, 403, 404].includes(error.status)) throw error;
      if (isAway(error)) onWait();
    }
    await pause(error?.retryAfterMs || waitMs, signal);
    // The stream may be refused for as long as others have theirs: the job tells how it stands.
    const {state, progress} = await (await readPatiently(job.links.self, {signal, onWait})).json();
    if (isFinal(state)) return;
    onProgress({...progress, state});
  }
}

/// The fields of each event. A stream that is silent for too long has ended.
async function* eventsOf(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let text = '';
  for (;;) {
    const watch = setTimeout(() => reader.cancel(), silenceMs);
    const {done, value} = await reader.read().finally(() => clearTimeout(watch));
    if (done) return;
    const events = (text + value).split('\n\n');
    text = events.pop();
    for (const event of events) yield Object.fromEntries(event.split('\n').map(line => line.split(/: ?(.*)/s, 2)));
  }
}
