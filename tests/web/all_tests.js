// All tests of the page, in one process, for they share a browser. Usage: node all_tests.js BIN_FOLDER
import './text_test.js';
import './render_test.js';
import './edit_test.js';
import './job_test.js';
import './access_test.js';
import './proxy_test.js';
import './away_test.js';
import './view_test.js';
