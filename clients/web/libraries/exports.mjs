// What the page uses of other people's libraries; `make` bundles it.
export {EditorState, Prec, Transaction} from '@codemirror/state';
export {Decoration, EditorView, MatchDecorator, ViewPlugin, keymap, lineNumbers} from '@codemirror/view';
export {defaultKeymap, history, historyKeymap, isolateHistory} from '@codemirror/commands';
export {bracketMatching} from '@codemirror/language';
export {forEachDiagnostic, setDiagnostics} from '@codemirror/lint';
export {search, searchKeymap} from '@codemirror/search';
export {findNodeAtLocation, modify, parseTree} from 'jsonc-parser';
