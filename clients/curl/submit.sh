#!/usr/bin/env bash
# submit.sh JOB.json|-
# Queues a job and prints its id. PENUMBRA_URL names the server (default http://127.0.0.1:8080), PENUMBRA_KEY
# is the key where it asks for one.
# Exit status: 0 queued, 1 refused, 2 wrong arguments, 3 no server.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
[[ ${1-} == --help ]] && { usage; exit 0; }
(($# == 1)) || { usage >&2; exit 2; }
must_read "$1"
request - "$url/v1/jobs" -H 'Content-Type: application/json' --data-binary "@$1" | jq -r .id
