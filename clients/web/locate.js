// Where in a JSON text the value of a JSON Pointer (RFC 6901) stands: {start, end}, or the nearest parent that is there.
// Nothing when the text is not JSON up to that place.
export function locate(text, pointer) {
  const path = pointer === '' ? [] : pointer.slice(1).split('/').map(part => part.replaceAll('~1', '/').replaceAll('~0', '~'));
  let at = 0;
  const space = () => { while (/\s/.test(text[at] ?? '')) ++at; };
  const string = () => {
    const start = at++;
    while (at < text.length && text[at] !== '"') at += text[at] === '\\' ? 2 : 1;
    return JSON.parse(text.slice(start, ++at));
  };

  // Walks over a value; returns the range of the wanted place if it is inside (`rest` is the path from here, or null).
  function value(rest) {
    space();
    const start = at;
    let found = null;
    const member = (key, isFound) => {
      const inside = value(isFound ? rest.slice(1) : null);
      if (isFound) found = inside;
    };
    if (text[at] === '{') {
      ++at;
      for (space(); text[at] !== '}' && at < text.length; space()) {
        const key = string();
        space();
        ++at;  // :
        member(key, rest?.length > 0 && key === rest[0]);
        space();
        if (text[at] === ',') ++at;
        space();
      }
      ++at;
    } else if (text[at] === '[') {
      ++at;
      let index = 0;
      for (space(); text[at] !== ']' && at < text.length; space()) {
        const before = at;
        member(index, rest?.length > 0 && String(index) === rest[0]);
        if (at === before) throw new SyntaxError('no JSON from here on');
        ++index;
        space();
        if (text[at] === ',') ++at;
      }
      ++at;
    } else if (text[at] === '"') {
      string();
    } else {
      while (at < text.length && !/[\s,\]}]/.test(text[at])) ++at;
    }
    return found ?? (rest ? {start, end: at} : null);
  }

  try {
    return value(path);
  } catch {
    return null;
  }
}
