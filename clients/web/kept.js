// What the browser keeps: in the tab, so that a reload finds what stood there, and beside it for the next tab. Several
// servers below one host have each their own.
export const folder = new URL('.', location.href);

function storageOf(name) {
  const full = item => `penumbra ${folder.pathname} ${item}`;
  return {
    read(item) {
      try {
        return window[name].getItem(full(item));
      } catch {
        return null;  // the browser keeps nothing
      }
    },
    /// Whether it is kept.
    write(item, text) {
      try {
        window[name].setItem(full(item), text);
        return true;
      } catch {
        return false;
      }
    },
  };
}

export const tabStorage = storageOf('sessionStorage');
const browserStorage = storageOf('localStorage');

/// Keeps the text and what is known about it; false when the browser has no room for it.
export function keep(text, about) {
  const written = [tabStorage, browserStorage].map(storage => storage.write('text', text) && storage.write('about', JSON.stringify(about)));
  return written[0];
}

/// {text, about} of this tab, else of the last one; nothing at the first visit.
export function kept() {
  for (const storage of [tabStorage, browserStorage]) {
    const text = storage.read('text');
    if (text !== null) return {text, about: JSON.parse(storage.read('about') ?? '{}')};
  }
  return null;
}
