// The text of the scene and the options. Only the lines that are seen are laid out, so that big scenes are typed in as fast
// as small ones.
import {Decoration, EditorState, EditorView, MatchDecorator, Prec, Transaction, ViewPlugin, bracketMatching, defaultKeymap,
        forEachDiagnostic, history, historyKeymap, isolateHistory, keymap, lineNumbers, search, searchKeymap,
        setDiagnostics} from './libraries.js';

// JSON's tokens end where their line ends, so that each line is colored by itself: a parser would read all of a big scene.
const [name, string, other] = ['name', 'string', 'other'].map(kind => Decoration.mark({class: `json-${kind}`}));
const tokens = new MatchDecorator({
  regexp: /"(?:[^"\\]|\\.)*"(\s*:)?|-?\d[\d.eE+-]*|\b(?:true|false|null)\b/g,
  decoration: ([text, colon]) => text[0] !== '"' ? other : colon ? name : string,
});
const colors = ViewPlugin.define(view => ({
  decorations: tokens.createDeco(view),
  update(update) { this.decorations = tokens.updateDeco(update, this.decorations); },
}), {decorations: plugin => plugin.decorations});

const theme = EditorView.theme({
  '&': {height: '100%', color: 'var(--ink)', backgroundColor: 'var(--page)', fontSize: '.82rem'},
  '&.cm-focused': {outline: 'none'},  // its host has one, which the gutter does not cover
  '.cm-scroller': {fontFamily: 'ui-monospace, monospace', lineHeight: 1.45, overflow: 'auto'},
  '.cm-content': {caretColor: 'var(--ink)'},
  // As wide as its own text: else a key in the longest line widens all others, which are laid out and painted again.
  '.cm-line': {width: 'max-content'},
  '.json-name': {color: 'var(--accent)'},
  '.json-string': {color: 'var(--string)'},
  '.json-other': {color: 'var(--number)'},
  '.cm-gutters': {color: 'var(--quiet)', backgroundColor: 'var(--panel)', borderRight: '1px solid var(--line)'},
  '.cm-content ::selection, .cm-line::selection': {backgroundColor: 'var(--chosen)'},
  '&.cm-focused .cm-matchingBracket': {backgroundColor: 'var(--chosen)'},
  '.cm-lintRange-error': {backgroundImage: 'none', backgroundColor: 'var(--bad-page)', textDecoration: 'underline wavy var(--bad)'},
  '.cm-tooltip, .cm-panels': {color: 'var(--ink)', backgroundColor: 'var(--panel)', borderColor: 'var(--line)'},
  '.cm-textfield, .cm-button': {color: 'var(--ink)', backgroundColor: 'var(--page)', backgroundImage: 'none', borderColor: 'var(--line)'},
  '.cm-textfield, .cm-button, .cm-panel.cm-search label': {fontSize: '.82rem'},
  '.cm-searchMatch': {backgroundColor: 'var(--chosen)'},
});

let view = null;
let opened = null;  // the document as it came, or was last sent; none where a reload found edits

/// `onChange()` hears of every change of the text, `onSubmit()` of Ctrl+Enter.
export function createEditor(host, {onChange, onSubmit}) {
  // In a shadow root the library's styles need no leave to stand in the page.
  const root = host.attachShadow({mode: 'open', delegatesFocus: true});
  const submit = () => { onSubmit(); return true; };
  view = new EditorView({
    parent: root,
    root,
    state: EditorState.create({extensions: [
      Prec.highest(keymap.of([{key: 'Mod-Enter', run: submit}])),
      keymap.of([...defaultKeymap, ...historyKeymap, ...searchKeymap]),
      history(), lineNumbers(), bracketMatching(), search({top: true}), colors, theme,
      EditorView.contentAttributes.of({'aria-label': host.ariaLabel}),
      EditorView.updateListener.of(update => update.docChanged && onChange()),
    ]}),
  });
  opened = view.state.doc;
}

export const text = () => view.state.doc.toString();
export const isEdited = () => !opened || !view.state.doc.eq(opened);

/// Another text, that may be undone. `edited` when nobody but the browser has it.
export function open(text, edited = false) {
  view.dispatch({changes: {from: 0, to: view.state.doc.length, insert: text}, selection: {anchor: 0}, scrollIntoView: true,
                 annotations: isolateHistory.of('full')});
  opened = edited ? null : view.state.doc;
}

/// The text as it is now, and a function that says that it has been sent.
export function sending() {
  const {doc} = view.state;
  return {text: doc.toString(), sent: () => { opened = doc; }};
}

/// Changes [{from, to, insert}] as one step of undo.
export function change(changes) {
  if (changes.length) view.dispatch({changes, annotations: [isolateHistory.of('full'), Transaction.userEvent.of('input.option')]});
}

/// Underlines ranges [{from, to, message, source}]; they move with the text.
export function mark(ranges) {
  view.dispatch(setDiagnostics(view.state, ranges.map(range => ({severity: 'error', ...range}))));
}

/// Selects what was marked for `source`.
export function selectMarked(source) {
  let found = null;
  forEachDiagnostic(view.state, (diagnostic, from, to) => { if (diagnostic.source === source) found ??= {from, to}; });
  if (found) select(found);
}

export function select({from, to}, focus = true) {
  view.dispatch({selection: {anchor: from, head: to}, effects: EditorView.scrollIntoView(from, {y: 'center'})});
  if (focus) view.focus();
}

export const selected = () => view.state.sliceDoc(view.state.selection.main.from, view.state.selection.main.to);
