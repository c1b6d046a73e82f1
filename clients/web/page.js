/// The element of this id.
export const by = id => document.getElementById(id);

/// A new element with properties and children.
export function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}
