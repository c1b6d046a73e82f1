#!/usr/bin/env bash
# wait.sh ID [PICTURE]
# Shows the percentage until the job is over, then fetches the picture. PENUMBRA_URL names the server (default
# http://127.0.0.1:8080), PENUMBRA_KEY is the key where it asks for one. Exit status: 0 succeeded, 1 failed, canceled or unknown, 2 wrong arguments, 3 no server.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
[[ ${1-} == --help ]] && { usage; exit 0; }
(($# == 1 || $# == 2)) || { usage >&2; exit 2; }
(($# == 1)) || must_write "$2"
request /dev/null "$url/v1/jobs/$1" || exit

# A live line on a terminal, a line a report elsewhere.
if [[ -t 2 ]]; then start='\r' end=''; else start='' end='\n'; fi
state=
follow() { # until the job is over, or the stream
  local field value
  while IFS=': ' read -r field value; do
    case $field in
      event) state=${value%$'\r'} ;;
      data)
        [[ $state == progress || $state == succeeded ]] && printf "$start%6.1f %%$end" "$(jq -r '.percent // .progress.percent' <<<"$value")" >&2
        [[ $state == progress ]] || return 0
        ;;
    esac
  done < <(call -N "$url/v1/jobs/$1/events")
  return 1
}
until follow "$1"; do
  # Cut off, or too many streams are open: come back, unless the server or the job is gone, or it is over.
  state=$(request - "$url/v1/jobs/$1" | jq -r .state) || exit
  [[ $state == queued || $state == running ]] || break
  sleep 1
done
[[ -t 2 ]] && echo >&2
if [[ $state != succeeded ]]; then
  request - "$url/v1/jobs/$1" | jq -r '"\(.state)\(if .error then ": " + .error.detail else "" end)"' >&2
  exit 1
fi
(($# == 1)) || request "$2" "$url/v1/jobs/$1/image"
