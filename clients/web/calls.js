// Calls of the server: relative to the page, for a proxy may have put it below a path of its own, and with a key where it
// asks for one. A key is kept as long as the tab is open.
import {folder, tabStorage} from './kept.js';

/// A path of the server, "/v1/…", as it is reached from here.
export const addressOf = path => new URL(path.replace(/^\/+/, ''), folder).href;

export const key = () => tabStorage.read('key') ?? '';

/// False when no key can look like this: a header field takes visible ASCII alone.
export function setKey(text) {
  if (!/^[\x21-\x7e]+$/.test(text)) return false;
  tabStorage.write('key', text);
  return true;
}

/// An answer of 4xx or 5xx.
export class Refusal extends Error {
  constructor(answer, problem) {
    super(problem.title ?? answer.statusText);
    this.status = answer.status;
    this.problem = problem;
    this.retryAfterMs = 1000 * Number(answer.headers.get('Retry-After')) || 0;
  }
}

/// The answer, or a Refusal. A TypeError is fetch's way to say that there is no server.
export async function call(path, options = {}) {
  const headers = key() ? {...options.headers, Authorization: `Bearer ${key()}`} : options.headers;
  const answer = await fetch(addressOf(path), {...options, headers});
  if (answer.status < 400) return answer;
  const fallback = {title: `The server answered ${answer.status} ${answer.statusText}`, status: answer.status};
  throw new Refusal(answer, {...fallback, ...await answer.json().catch(() => ({}))});
}

/// What a proxy says of a server that is away, and what the server says while it starts or stops.
export const isAway = error => !(error instanceof Refusal) || [502, 503, 504].includes(error.status);

export const pause = (ms, signal) => new Promise((resolve, reject) => {
  signal?.throwIfAborted();
  const timer = setTimeout(resolve, ms);
  signal?.addEventListener('abort', () => { clearTimeout(timer); reject(signal.reason); }, {once: true});
});

/// The same, but a server that is away is asked again until it answers. `onWait(error)` hears of each time;
/// `isWorthWaiting(error)` says for what besides.
export async function callPatiently(path, {onWait, isWorthWaiting = isAway, ...options} = {}) {
  for (let waitMs = 1000;; waitMs = Math.min(2 * waitMs, 8000)) {
    try {
      return await call(path, options);
    } catch (error) {
      if (options.signal?.aborted || !isWorthWaiting(error)) throw error;
      onWait?.(error);
      await pause(error.retryAfterMs || waitMs, options.signal);
    }
  }
}

/// For what is only read, too many requests are no refusal.
export const readPatiently = (path, options) =>
  callPatiently(path, {isWorthWaiting: error => isAway(error) || error.status === 429, ...options});

/// What an <img> or a link can load: the address itself, or the bytes where a key is needed, for neither can send one.
export async function urlOf(path) {
  return key() ? bytesOf(path) : addressOf(path);
}

/// The bytes as they are now, whatever the browser has kept.
export async function bytesOf(path) {
  return URL.createObjectURL(await (await call(path)).blob());
}

export function forget(url) {
  if (url?.startsWith('blob:')) URL.revokeObjectURL(url);
}
