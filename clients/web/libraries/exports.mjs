// What the page uses of other people's libraries; `make` bundles it.
export {EditorState, Prec, Transaction} from '@codemirror/state';
export {EditorView, keymap, lineNumbers} from '@codemirror/view';
export {defaultKeymap, history, historyKeymap, isolateHistory} from '@codemirror/commands';
export {bracketMatching, HighlightStyle, syntaxHighlighting} from '@codemirror/language';
export {json} from '@codemirror/lang-json';
export {forEachDiagnostic, setDiagnostics} from '@codemirror/lint';
export {search, searchKeymap} from '@codemirror/search';
export {tags} from '@lezer/highlight';
export {findNodeAtLocation, modify, parseTree} from 'jsonc-parser';
