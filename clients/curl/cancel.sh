#!/usr/bin/env bash
# cancel.sh ID
# Cancels a job and prints its state. PENUMBRA_URL names the server (default http://127.0.0.1:8080), PENUMBRA_KEY
# is the key where it asks for one.
# Exit status: 0 canceled, 1 unknown or over already, 2 wrong arguments, 3 no server.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
[[ ${1-} == --help ]] && { usage; exit 0; }
(($# == 1)) || { usage >&2; exit 2; }
request - -X POST -H 'Content-Length: 0' "$url/v1/jobs/$1/cancel" | jq -r .state
