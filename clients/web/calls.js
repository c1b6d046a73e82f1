// Calls of the server, with a key where it asks for one. A key is kept as long as the tab is open.
const storage = 'penumbra-key';

export const key = () => sessionStorage.getItem(storage) ?? '';

export function setKey(text) {
  if (text) sessionStorage.setItem(storage, text);
  else sessionStorage.removeItem(storage);
}

/// fetch, with the key.
export function call(path, options = {}) {
  const headers = key() ? {...options.headers, Authorization: `Bearer ${key()}`} : options.headers;
  return fetch(path, {...options, headers});
}

/// What an <img> or a link can load: the path itself, or the bytes where a key is needed, for neither can send one.
export async function urlOf(path) {
  if (!key()) return path;
  const answer = await call(path);
  if (!answer.ok) throw new Error(answer.statusText);
  return URL.createObjectURL(await answer.blob());
}

/// An EventSource, or where a key is needed something like it: the events of `names` go to `onEvent(name, data)`, the
/// loss of the stream to `onLost(isOver)`, after which it is asked for again unless it is over.
export function follow(path, names, onEvent, onLost) {
  if (key()) return new KeyedEvents(path, names, onEvent, onLost);
  const events = new EventSource(path);
  for (const name of names) events.addEventListener(name, event => onEvent(name, event.data));
  events.addEventListener('error', () => onLost(events.readyState === EventSource.CLOSED));
  return events;
}

class KeyedEvents {
  constructor(path, names, onEvent, onLost) {
    this.aborter = new AbortController();
    this.lastId = '';
    this.run(path, names, onEvent, onLost);
  }

  close() {
    this.aborter.abort();
  }

  async run(path, names, onEvent, onLost) {
    const {signal} = this.aborter;
    while (!signal.aborted) {
      try {
        const answer = await call(path, {signal, headers: this.lastId ? {'Last-Event-ID': this.lastId} : {}});
        if (answer.status !== 200) return onLost(true);
        const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
        for (let text = '', part = await reader.read(); !part.done; part = await reader.read()) {
          const events = (text + part.value).split('\n\n');
          text = events.pop();
          for (const event of events) this.tell(event, names, onEvent);
        }
      } catch {
        // The network failed, or this was closed.
      }
      if (signal.aborted) return;
      onLost(false);
      await new Promise(resolve => setTimeout(resolve, 1000));
    }
  }

  tell(event, names, onEvent) {
    const fields = Object.fromEntries(event.split('\n').filter(line => !line.startsWith(':')).map(line => line.split(/: (.*)/s, 2)));
    if (fields.id) this.lastId = fields.id;
    if (names.includes(fields.event)) onEvent(fields.event, fields.data);
  }
}
