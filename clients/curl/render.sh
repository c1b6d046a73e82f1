#!/usr/bin/env bash
# render.sh JOB.json|- PICTURE.png
# Renders and waits. Interrupting it cancels the job. PENUMBRA_URL names the server (default http://127.0.0.1:8080), PENUMBRA_KEY
# is the key where it asks for one.
# Exit status: 0 done, 1 refused or failed, 2 wrong arguments, 3 no server.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
[[ ${1-} == --help ]] && { usage; exit 0; }
(($# == 2)) || { usage >&2; exit 2; }
must_read "$1"
must_write "$2"
request "$2" "$url/v1/render" -H 'Content-Type: application/json' --data-binary "@$1"
